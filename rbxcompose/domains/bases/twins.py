"""Twins of a differential base and of a chore."""

from __future__ import annotations

import math

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2
from rbxcompose.domains.bases.driving import ABSURD

ROUNDING = 1e-12  # a smaller difference of velocities counts as none [m/s, rad/s]
NOTHING_LEFT = 1e-9  # [s]; anything less is rounding from many small steps, not work


@dataclass(frozen=True, slots=True)
class DiffDriveSettings:
    """Limits of the base, all above zero."""

    max_speed: float = 0.5
    """[m/s], forwards and backwards."""
    max_turn_rate: float = math.radians(90)
    """[rad/s]."""
    acceleration: float = 1.0
    """Acceleration when speeding up and braking [m/s^2]."""
    turn_acceleration: float = 3.0
    """Angular acceleration [rad/s^2]."""
    command_timeout: float = 0.5
    """The base brakes when its last command is older than this [s]."""


class DiffDriveCore:
    """Moves along exact arcs; while both velocities change, with their means until one has reached its target.

    So heading and distance driven never depend on how time is divided into steps, and neither does the position, except
    slightly while speed and turn rate change together. `settings` may be replaced while driving.
    """

    def __init__(self, settings: DiffDriveSettings, pose: Pose2 | None = None) -> None:
        self.settings = settings
        self.pose = pose or Pose2()
        self.velocity = AT_REST
        self.distance = 0.0  # distance driven so far [m]; driving backwards counts, too
        self.dropped = 0  # commands that were not finite, or absurd
        self.clamped = 0  # commands that were clamped to a limit
        self._target = AT_REST
        self._target_until = -math.inf
        self._braking = False

    @property
    def at_rest(self) -> bool:
        """Return whether the base stands still."""
        return self.velocity == AT_REST

    def command(self, velocity: Velocity2, now: float) -> None:
        """Accept the velocity to reach; it holds for `command_timeout`. While braking it is ignored."""
        speed, turn_rate = self.settings.max_speed, self.settings.max_turn_rate
        excess = max(abs(velocity.linear) / speed, abs(velocity.angular) / turn_rate)
        if not velocity.is_finite or excess > ABSURD:
            self.dropped += 1
            return
        if excess > 1.0:
            self.clamped += 1
            velocity = Velocity2(_clamp(velocity.linear, speed), _clamp(velocity.angular, turn_rate))
        if not self._braking:
            self._target = velocity
            self._target_until = now + self.settings.command_timeout

    def forget(self) -> None:
        """Brake until the next command."""
        self._target_until = -math.inf

    def brake(self) -> None:
        """Come to rest and stay there, whatever is commanded, until `release`."""
        self._braking = True
        self.forget()

    def release(self) -> None:
        """Follow commands again; the base stays at rest until the next one."""
        self._braking = False

    def step(self, now: float, dt: float) -> None:
        """Move through the `dt` [s] that end at `now`; the command holds up to its deadline, not to the step's end."""
        driven = min(max(self._target_until - (now - dt), 0.0), dt)
        self._follow(self._target, driven)
        self._follow(AT_REST, dt - driven)

    def _follow(self, target: Velocity2, duration: float) -> None:
        if duration <= 0.0 or self.velocity == target == AT_REST:
            return
        elapsed = 0.0
        for until in self._corners(target, duration):
            dt = until - elapsed
            before = self.velocity
            self.velocity = Velocity2(
                _towards(before.linear, target.linear, self.settings.acceleration * dt),
                _towards(before.angular, target.angular, self.settings.turn_acceleration * dt),
            )
            mean = Velocity2((before.linear + self.velocity.linear) / 2, (before.angular + self.velocity.angular) / 2)
            self.pose = self.pose.moved(mean, dt)
            self.distance += abs(mean.linear) * dt
            elapsed = until

    def _corners(self, target: Velocity2, duration: float) -> list[float]:
        """Return the moments up to `duration` between which both velocities are linear and keep their signs [s]."""
        now, limits = self.velocity, self.settings
        if now == target:
            return [duration]
        corners = (
            abs(now.linear) / limits.acceleration,
            abs(target.linear - now.linear) / limits.acceleration,
            abs(target.angular - now.angular) / limits.turn_acceleration,
        )
        return sorted({duration, *(corner for corner in corners if 0.0 < corner < duration)})


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _towards(value: float, target: float, most: float) -> float:
    """Return `value` moved towards `target` by at most `most`."""
    change = target - value
    return target if abs(change) <= most + ROUNDING else value + math.copysign(most, change)


@dataclass(frozen=True, slots=True)
class ChoreSettings:
    """How the base moves meanwhile."""

    speed: float = 0.0
    """Forwards in one stroke, backwards in the next [m/s]."""
    turn_rate: float = 0.0
    """To the left in all strokes [rad/s]."""
    stroke: float = 1.0
    """Duration of a stroke [s], above zero."""


class ChoreCore:
    """Work of a given duration, in strokes; each chore starts its own count."""

    def __init__(self, settings: ChoreSettings) -> None:
        self.settings = settings
        self.done = 0.0  # [s]
        self.left = 0.0  # [s]

    def start(self, duration: float) -> None:
        """Begin a chore of `duration` [s]."""
        self.done, self.left = 0.0, duration

    @property
    def is_done(self) -> bool:
        """Return whether nothing is left to do."""
        return self.left <= NOTHING_LEFT

    def step(self, dt: float) -> Velocity2:
        """Work for `dt` [s]; return the velocity of the base meanwhile."""
        if self.is_done:
            return AT_REST
        stroke = int((self.done + NOTHING_LEFT) / self.settings.stroke)
        self.done, self.left = self.done + dt, self.left - dt
        speed = self.settings.speed if stroke % 2 == 0 else -self.settings.speed
        return Velocity2(speed, self.settings.turn_rate)
