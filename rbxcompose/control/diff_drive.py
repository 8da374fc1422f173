"""A base with two driven wheels: from its velocity to those of its wheels, within limits and deadlines.

The base has its frame between the wheels, x forwards; turning left is positive. All times are robot time [s].
"""

from __future__ import annotations

import math
from dataclasses import astuple, replace

from rbxcompose.control.velocity_window import VelocityWindow
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import AT_REST, Velocity2

ABSURD = 2.0  # a command above this many times a limit is a fault of its sender, not a wish to go fast
ROUNDING = 1e-12  # a smaller difference of velocities counts as none [m/s, rad/s]


@dataclass(frozen=True, slots=True)
class WheelGeometry:
    """Wheels and what is measured of them. ValueError if it cannot be."""

    wheel_distance: float
    """Between the points where the wheels touch the ground [m]."""
    metres_per_unit: float
    """Way of a wheel for each unit of its position [m/rad or m/tick]."""
    counts: int | None = None
    """Encoders start again at 0 after this many ticks; None if positions go on."""

    def __post_init__(self) -> None:
        for value in (self.wheel_distance, self.metres_per_unit):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"a distance or a radius of {value} is none")

    @classmethod
    def of_radius(cls, wheel_radius: float, wheel_distance: float) -> WheelGeometry:
        """Return that of wheels [m] whose positions are angles [rad]."""
        return cls(wheel_distance, wheel_radius)

    @classmethod
    def of_ticks(cls, ticks_per_metre: float, wheel_distance: float, counts: int | None = None) -> WheelGeometry:
        """Return that of wheels whose positions are counts of their encoders."""
        return cls(wheel_distance, 1.0 / ticks_per_metre if ticks_per_metre else math.inf, counts)

    def wheels(self, velocity: Velocity2) -> WheelSpeeds:
        """Return the speeds of the wheels [units/s] that move the base at `velocity`."""
        half = velocity.angular * self.wheel_distance / 2.0
        scale = self.metres_per_unit
        return WheelSpeeds((velocity.linear - half) / scale, (velocity.linear + half) / scale)

    def fastest(self, velocity: Velocity2) -> float:
        """Return the speed of the faster wheel [units/s] at a velocity of the base."""
        wheels = self.wheels(velocity)
        return max(abs(wheels.left), abs(wheels.right))

    def velocity(self, wheels: WheelSpeeds) -> Velocity2:
        """Return the velocity of the base whose wheels turn at these speeds [units/s] and do not slip."""
        left, right = wheels.left * self.metres_per_unit, wheels.right * self.metres_per_unit
        return Velocity2((left + right) / 2.0, (right - left) / self.wheel_distance)


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Of the left and the right wheel, in units of their positions per second: [rad/s] or [ticks/s]."""

    left: float = 0.0
    right: float = 0.0


@dataclass(frozen=True, slots=True)
class BaseLimits:
    """Limits of a base, all above 0."""

    speed: float = 0.5
    """[m/s], forwards and backwards."""
    turn_rate: float = math.radians(90)
    """[rad/s]."""
    acceleration: float = 1.0
    """Speeding up and braking [m/s^2]."""
    turn_acceleration: float = 3.0
    """[rad/s^2]."""
    jerk: float | None = None
    """[m/s^3]; None is none."""
    turn_jerk: float | None = None
    """[rad/s^3]; None is none."""

    def __post_init__(self) -> None:
        if not all(value > 0.0 for value in astuple(self) if value is not None):
            raise ValueError("limits of a base are above 0")

    def of_wheels(self, geometry: WheelGeometry, acceleration: float) -> BaseLimits:
        """Return these limits, tightened so that no wheel accelerates by more than `acceleration` [units/s^2]."""
        needed = geometry.fastest(Velocity2(self.acceleration, self.turn_acceleration))
        part = min(1.0, acceleration / needed)
        return replace(self, acceleration=self.acceleration * part, turn_acceleration=self.turn_acceleration * part)

    @property
    def smoothing(self) -> float:
        """Over how long velocities are averaged [s], so that the jerk is kept: see `VelocityWindow`."""
        pairs = ((self.acceleration, self.jerk), (self.turn_acceleration, self.turn_jerk))
        return max((2.0 * acceleration / jerk for acceleration, jerk in pairs if jerk is not None), default=0.0)


class TwistLimiter:
    """Leads the velocity of a base towards a target within its limits.

    What is too much is scaled as a whole: forwards and turning keep their ratio, and so does the curvature of the path
    from rest to a velocity and back to rest.
    """

    def __init__(self, limits: BaseLimits) -> None:
        self.limits = limits
        self.rest()

    def rest(self) -> None:
        """Start again from rest."""
        self.velocity = AT_REST
        self._ramp = AT_REST  # the velocity before it is averaged
        self._window = VelocityWindow(self.limits.smoothing)

    def within(self, velocity: Velocity2) -> Velocity2:
        """Return a velocity scaled to the limits of speed and turn rate."""
        return _scaled(velocity, min(1.0, 1.0 / max(self.excess(velocity), 1.0)))

    def excess(self, velocity: Velocity2) -> float:
        """Return how many times too fast a velocity is."""
        return max(abs(velocity.linear) / self.limits.speed, abs(velocity.angular) / self.limits.turn_rate)

    def step(self, target: Velocity2, dt: float) -> Velocity2:
        """Return the velocity after `dt` [s] towards `target`."""
        wanted = self.within(target)
        change = Velocity2(wanted.linear - self._ramp.linear, wanted.angular - self._ramp.angular)
        needed = max(
            abs(change.linear) / self.limits.acceleration, abs(change.angular) / self.limits.turn_acceleration
        )  # [s]
        if needed <= dt + ROUNDING:
            self._ramp = wanted
        else:
            part = _scaled(change, dt / needed)
            self._ramp = Velocity2(self._ramp.linear + part.linear, self._ramp.angular + part.angular)
        self.velocity = self._window.add(self._ramp, dt)
        return self.velocity


class WheelDrive:
    """Follows commands for the velocity of a base; without new ones it brakes within its limits."""

    def __init__(
        self,
        geometry: WheelGeometry,
        limits: BaseLimits,
        command_timeout: float = 0.5,
        wheel_speed: float = math.inf,
    ) -> None:
        """`command_timeout` [s] is how long a command holds; 0 is for ever. `wheel_speed` limits wheels [units/s]."""
        self.geometry = geometry
        self.wheel_speed = wheel_speed
        self.limiter = TwistLimiter(limits)
        self.command_timeout = command_timeout
        self.refused = 0  # commands that were not finite, or absurd
        self.clamped = 0  # commands that were scaled down to a limit
        self._target = AT_REST
        self._until = -math.inf
        self._braking = False

    @property
    def velocity(self) -> Velocity2:
        """The velocity that the wheels are to have now."""
        return self.limiter.velocity

    @property
    def at_rest(self) -> bool:
        """Return whether the wheels are to stand still."""
        return self.velocity == AT_REST

    @property
    def is_commanded(self) -> bool:
        """Return whether a command holds."""
        return self._until > -math.inf

    def command(self, velocity: Velocity2, now: float) -> str | None:
        """Accept the velocity to reach; return why it is refused, else None. While braking it is ignored."""
        excess = self.limiter.excess(velocity) if velocity.is_finite else math.inf
        if excess > ABSURD:
            self.refused += 1
            return _refusal(velocity, excess)
        target = self._within_wheels(self.limiter.within(velocity))
        self.clamped += target != velocity
        if not self._braking:
            self._target = target
            self._until = now + self.command_timeout if self.command_timeout else math.inf
        return None

    def _within_wheels(self, velocity: Velocity2) -> Velocity2:
        """Return a velocity scaled to what the wheels can do."""
        fastest = self.geometry.fastest(velocity)
        return velocity if fastest <= self.wheel_speed else _scaled(velocity, self.wheel_speed / fastest)

    def forget(self) -> None:
        """Come to rest, and stay there until the next command."""
        self._until = -math.inf

    def rest(self) -> None:
        """Be at rest at once: the wheels are not driven any more."""
        self.forget()
        self.limiter.rest()

    def brake(self) -> None:
        """Come to rest and stay there, whatever is commanded, until `release`."""
        self._braking = True
        self.forget()

    def release(self) -> None:
        """Follow commands again; the base stays at rest until the next one."""
        self._braking = False

    def step(self, now: float, dt: float) -> WheelSpeeds:
        """Return the speeds of the wheels at `now`, `dt` [s] after the last ones.

        A command holds up to its deadline, not to the end of the step. ValueError if `dt` is not above 0.
        """
        if not (math.isfinite(dt) and dt > 0.0):
            raise ValueError(f"a step of {dt} s is no step")
        driven = min(max(self._until - (now - dt), 0.0), dt)
        if driven > 0.0:
            self.limiter.step(self._target, driven)
        if driven < dt:
            self.forget()
            self.limiter.step(AT_REST, dt - driven)
        return self.geometry.wheels(self.velocity)


def _refusal(velocity: Velocity2, excess: float) -> str:
    told = f"{velocity.linear:g} m/s and {velocity.angular:g} rad/s"
    return f"{told} is {excess:.1f} times too fast" if velocity.is_finite else f"{told} is no velocity"


def _scaled(velocity: Velocity2, factor: float) -> Velocity2:
    return Velocity2(velocity.linear * factor, velocity.angular * factor)
