"""Short manoeuvres that need no map: backing up and turning on the spot."""

from __future__ import annotations

import math
from enum import StrEnum

from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.domains.navigation.costs import LayeredCosts

SEEN_BEHIND = 0.15  # [m] that must be free behind the robot
SEEN_ASIDE = 0.2  # [rad] by which there must be room to turn further
NEAR, ALIGNED = 0.01, 0.02  # [m], [rad] from its end at which a manoeuvre is over
SLOWEST = 0.1  # [rad/s] at which a turn ends


class ManoeuvreState(StrEnum):
    """How a manoeuvre stands."""

    MOVES = "moves"
    DONE = "done"
    BLOCKED = "blocked"


class BackUpManoeuvre:
    """Drives straight backwards, as far as nothing is there."""

    def __init__(self, distance: float, speed: float) -> None:
        """Take the distance [m] and the speed [m/s], both above zero."""
        self.whole = self.left = distance
        """[m]"""
        self._speed = speed
        self._last: Pose2 | None = None

    def update(self, pose: Pose2, costs: LayeredCosts | None, dt: float) -> tuple[Velocity2, ManoeuvreState]:
        """Return the velocity for the next `dt` [s] at a pose in `map`; a robot that stands too near already may move
        away."""
        if self._last is not None:
            self.left -= self._last.distance(pose)
        self._last = pose
        if self.left <= NEAR:
            return AT_REST, ManoeuvreState.DONE
        if costs is not None:
            behind = (pose.moved(Velocity2(-distance), 1.0) for distance in (SEEN_BEHIND / 2, SEEN_BEHIND))
            if costs.clear_at(*behind) < min(0.0, costs.clear_at(pose)):
                return AT_REST, ManoeuvreState.BLOCKED
        return Velocity2(-min(self._speed, self.left / dt)), ManoeuvreState.MOVES


class SpinManoeuvre:
    """Turns on the spot, as far as no corner of the robot touches something: one that is round needs no more room."""

    def __init__(self, angle: float, turn_rate: float, acceleration: float) -> None:
        """Take the angle, to the left if it is above zero [rad], the turn rate [rad/s] and the acceleration
        [rad/s^2]."""
        self.whole = self.left = angle
        """[rad]"""
        self._turn_rate, self._acceleration = turn_rate, acceleration
        self._commanded = 0.0
        self._last: float | None = None

    def update(self, pose: Pose2, costs: LayeredCosts | None, dt: float) -> tuple[Velocity2, ManoeuvreState]:
        """Return the velocity for the next `dt` [s] at a pose in `map`."""
        if self._last is not None:
            self.left -= wrap_angle(pose.heading - self._last)
        self._last = pose.heading
        if abs(self.left) <= ALIGNED:
            return AT_REST, ManoeuvreState.DONE
        if costs is not None:
            ahead = math.copysign(min(abs(self.left), SEEN_ASIDE), self.left)
            turned = (Pose2(pose.x, pose.y, pose.heading + part * ahead) for part in (0.5, 1.0))
            if costs.clear_at(*turned) < min(0.0, costs.clear_at(pose)):
                return AT_REST, ManoeuvreState.BLOCKED
        most = min(self._turn_rate, math.sqrt(2 * self._acceleration * abs(self.left)), abs(self.left) / dt)
        self._commanded = min(max(most, SLOWEST), self._commanded + self._acceleration * dt)
        return Velocity2(0.0, math.copysign(self._commanded, self.left)), ManoeuvreState.MOVES


Manoeuvre = BackUpManoeuvre | SpinManoeuvre
