"""What a joint may do, and commands that keep to it.

Positions are [rad] for joints that turn and [m] for joints that slide; velocities and accelerations accordingly. All
times are robot time [s].
"""

from __future__ import annotations

import math
from dataclasses import fields

from rbxcompose.base.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Limits of a joint; None means that there is none. ValueError if one is no usable number."""

    lower: float | None = None
    """Least position [rad or m]."""
    upper: float | None = None
    """Greatest position [rad or m]."""
    velocity: float | None = None
    """Greatest speed, in both directions [rad/s or m/s]; at 0 the joint stands still."""
    acceleration: float | None = None
    """Greatest acceleration, speeding up and braking [rad/s^2 or m/s^2], above 0."""
    effort: float | None = None
    """Greatest torque or force [Nm or N]."""
    jerk: float | None = None
    """Greatest jerk of planned motions [rad/s^3 or m/s^3], above 0."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None and not math.isfinite(value):
                raise ValueError(f"the limit '{field.name}' is {value}, not a finite number")
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise ValueError(f"the lower limit {self.lower:g} is above the upper one, {self.upper:g}")
        if min(self.velocity or 0.0, self.effort or 0.0) < 0.0:
            raise ValueError("limits of velocity and effort are not below 0")
        if self.acceleration is not None and self.acceleration <= 0.0:
            raise ValueError("a joint that cannot accelerate cannot stop: its limit is above 0")
        if self.jerk is not None and self.jerk <= 0.0:
            raise ValueError("an acceleration that cannot change stays 0: the limit of jerk is above 0")

    @property
    def least(self) -> float:
        """The least position, -inf without a limit."""
        return -math.inf if self.lower is None else self.lower

    @property
    def greatest(self) -> float:
        """The greatest position, inf without a limit."""
        return math.inf if self.upper is None else self.upper

    @property
    def speed(self) -> float:
        """The greatest speed, inf without a limit."""
        return math.inf if self.velocity is None else self.velocity

    @property
    def are_endless(self) -> bool:
        """Whether all positions are within the range."""
        return self.lower is None and self.upper is None

    def clamped(self, position: float) -> float:
        """Return the position nearest to `position` that is within the range."""
        return max(self.least, min(self.greatest, position))


@dataclass(frozen=True, slots=True)
class Tightened:
    """The limits that two sources leave."""

    limits: MotionLimits | None
    """None if no position is within both ranges."""
    wider: tuple[str, ...] = ()
    """The names of the limits that the second source would have widened."""


def tightened(outer: MotionLimits, inner: MotionLimits) -> Tightened:
    """Return the limits `outer` (of the body) tightened by `inner` (of the manifest), which never widen them."""
    wider: list[str] = []
    for field in fields(MotionLimits):
        first, second = getattr(outer, field.name), getattr(inner, field.name)
        if first is not None and second is not None and (second < first if field.name == "lower" else second > first):
            wider.append(field.name)
    least, greatest = max(outer.least, inner.least), min(outer.greatest, inner.greatest)
    if least > greatest:
        return Tightened(None, tuple(wider))
    tight = MotionLimits(
        least if math.isfinite(least) else None,
        greatest if math.isfinite(greatest) else None,
        _smaller(outer.velocity, inner.velocity),
        _smaller(outer.acceleration, inner.acceleration),
        _smaller(outer.effort, inner.effort),
        _smaller(outer.jerk, inner.jerk),
    )
    return Tightened(tight, tuple(wider))


def stopping_speed(distance: float, dt: float, acceleration: float | None) -> float:
    """Return the greatest speed in a step of `dt` [s] after which the joint can still stop within `distance`, >= 0.

    It solves v^2 / (2 a) + v dt = distance, without the cancellation of the usual form. Every later step first brakes
    and then moves. So the joint drives a lower sum of v(t), never more than v^2 / (2 a), however time is divided.
    """
    if acceleration is None:
        return distance / dt
    return 2.0 * distance / (dt + math.hypot(dt, math.sqrt(2.0 * distance / acceleration)))


class Limiter:
    """Leads the command of a joint from the LAST COMMAND towards a wanted position within its limits.

    It stops in time at the limits and, without overshoot, at the wanted position. A joint that was put outside of its
    range moves inwards only. `limits` may be replaced: another velocity at any time, another range or acceleration at
    rest, since a joint that moves may no longer be able to stop in time.
    """

    def __init__(self, limits: MotionLimits, position: float) -> None:
        self.limits = limits
        self.reseed(position)

    def reseed(self, position: float) -> None:
        """Start again from a measured `position`, at rest. ValueError if it is not finite."""
        if not math.isfinite(position):
            raise ValueError(f"a joint cannot start from the position {position}")
        self.put(position)
        self._wanted, self._wanted_velocity = position, 0.0

    def put(self, position: float) -> None:
        """Go on from a measured `position`, at rest, to what is wanted."""
        self.position, self.velocity = position, 0.0

    @property
    def is_at_rest(self) -> bool:
        """Return whether the last command did not move."""
        return self.velocity == 0.0

    @property
    def is_settled(self) -> bool:
        """Return whether the next step changes nothing: it is where it is wanted, within its limits, and at rest."""
        return (
            self.velocity == self._wanted_velocity == 0.0
            and self._wanted == self.position
            and self.limits.least <= self.position <= self.limits.greatest
        )

    def want(self, position: float, velocity: float = 0.0) -> str | None:
        """Set where to be at the end of the next step, and how fast to pass there; return why it is rejected, if it is.

        Without a repetition the joint stops at `position`. A sender that tracks a path gives the `velocity`, since a
        joint that must be able to stop at each wanted position lags behind by v^2 / (2 a).
        """
        if not (math.isfinite(position) and math.isfinite(velocity)):
            return f"position {position} and velocity {velocity} are not both finite numbers"
        self._wanted, self._wanted_velocity = position, velocity
        return None

    def brake(self) -> None:
        """Stop as soon as the limits allow, and stay there until something else is wanted."""
        acceleration = self.limits.acceleration
        way = 0.0 if acceleration is None else self.velocity * abs(self.velocity) / (2.0 * acceleration)
        self._wanted, self._wanted_velocity = self.limits.clamped(self.position + way), 0.0

    def step(self, dt: float) -> None:
        """Go on to the command after `dt` [s]. ValueError if `dt` is not a finite number above 0."""
        if not (math.isfinite(dt) and dt > 0.0):
            raise ValueError(f"a step of {dt} s is no step")
        wished = self._velocity_towards(self.limits.clamped(self._wanted), dt)
        velocity = max(-self.limits.speed, min(self.limits.speed, wished))
        self._move(self._reachable(velocity, dt), dt)
        self._wanted_velocity = 0.0

    def _velocity_towards(self, wanted: float, dt: float) -> float:
        """Return the velocity that leads to `wanted`, as seen by an observer that moves with the wanted velocity."""
        passing = self._wanted_velocity if wanted == self._wanted else 0.0
        gap = wanted - passing * dt - self.position
        wished = passing + math.copysign(stopping_speed(abs(gap), dt, self.limits.acceleration), gap)
        return max(-self._room(-1.0, dt), min(self._room(1.0, dt), wished))

    def _room(self, direction: float, dt: float) -> float:
        """Return the greatest speed in a direction, 1 or -1, from which the joint can stop at its limit."""
        end = self.limits.greatest if direction > 0.0 else -self.limits.least
        distance = max(0.0, end - direction * self.position)
        return math.inf if math.isinf(distance) else stopping_speed(distance, dt, self.limits.acceleration)

    def _reachable(self, velocity: float, dt: float) -> float:
        if self.limits.acceleration is None:
            return velocity
        change = self.limits.acceleration * dt
        return max(self.velocity - change, min(self.velocity + change, velocity))

    def _move(self, velocity: float, dt: float) -> None:
        before = self.position
        self.velocity = velocity
        # Rounding must not carry it over a limit; where it was put outside, it stays allowed to be.
        least, greatest = min(self.limits.least, before), max(self.limits.greatest, before)
        self.position = max(least, min(greatest, before + velocity * dt))


def _smaller(first: float | None, second: float | None) -> float | None:
    return min((value for value in (first, second) if value is not None), default=None)
