"""Short manoeuvres that need no map: backing up and turning on the spot."""

from __future__ import annotations

import math
from enum import StrEnum

from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.domains.bases.driving import PROGRESS, PROGRESS_TURN, ProgressWatch
from rbxcompose.domains.navigation.costs import LayeredCosts

SEEN_BEHIND = 0.15  # [m] that must be free behind the robot
SEEN_ASIDE = 0.2  # [rad] by which there must be room to turn further
NEAR, ALIGNED = 0.01, 0.02  # [m], [rad] from its end at which a manoeuvre is over
SLOWEST = 0.1  # [rad/s] at which a turn ends
SEVERAL = 5  # times as long as it should take, a manoeuvre may take at most,
PATIENCE = 5.0  # [s] besides


class ManoeuvreState(StrEnum):
    """How a manoeuvre stands."""

    MOVES = "moves"
    DONE = "done"
    BLOCKED = "blocked"
    STUCK = "stuck"


class _Patience:
    """Ends with a robot that hardly moves, or needs several times as long as it should."""

    def __init__(self, longest: float, idle: float) -> None:
        """Take for how long [s] a robot that does as it is told moves, and may seem to stand."""
        self._longest, self._idle = (PATIENCE + SEVERAL * time for time in (longest, idle))
        self._time, self._progress = 0.0, ProgressWatch()

    def ends(self, pose: Pose2, dt: float) -> bool:
        """Take a pose `dt` [s] after the one before; return whether it is over."""
        self._progress.update(pose, dt)
        self._time += dt
        return self._progress.idle > self._idle or self._time > self._longest


class BackUpManoeuvre:
    """Drives straight backwards, as far as nothing is there."""

    def __init__(self, distance: float, speed: float) -> None:
        """Take the distance [m] and the speed [m/s], both above zero."""
        self.whole = self.left = distance
        """[m]"""
        self._speed = speed
        self._start: Pose2 | None = None
        self._patience = _Patience(distance / speed, PROGRESS / speed)

    def update(self, pose: Pose2, costs: LayeredCosts | None, dt: float) -> tuple[Velocity2, ManoeuvreState]:
        """Return the velocity for the next `dt` [s] at a pose in `map`; a robot that stands too near already may move
        away."""
        self._start = self._start or pose
        self.left = self.whole - self._start.distance(pose)
        if self.left <= NEAR:
            return AT_REST, ManoeuvreState.DONE
        behind = [pose.moved(Velocity2(-distance), 1.0) for distance in (SEEN_BEHIND / 2, SEEN_BEHIND)]
        if costs is not None and costs.comes_nearer(pose, behind, 0.0):
            return AT_REST, ManoeuvreState.BLOCKED
        if self._patience.ends(pose, dt):
            return AT_REST, ManoeuvreState.STUCK
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
        self._patience = _Patience(abs(angle) / turn_rate, PROGRESS_TURN / turn_rate)

    def update(self, pose: Pose2, costs: LayeredCosts | None, dt: float) -> tuple[Velocity2, ManoeuvreState]:
        """Return the velocity for the next `dt` [s] at a pose in `map`."""
        if self._last is not None:
            self.left -= wrap_angle(pose.heading - self._last)
        self._last = pose.heading
        if abs(self.left) <= ALIGNED:
            return AT_REST, ManoeuvreState.DONE
        ahead = math.copysign(min(abs(self.left), SEEN_ASIDE), self.left)
        turned = [Pose2(pose.x, pose.y, pose.heading + part * ahead) for part in (0.5, 1.0)]
        if costs is not None and costs.comes_nearer(pose, turned, 0.0):
            return AT_REST, ManoeuvreState.BLOCKED
        if self._patience.ends(pose, dt):
            return AT_REST, ManoeuvreState.STUCK
        most = min(self._turn_rate, math.sqrt(2 * self._acceleration * abs(self.left)), abs(self.left) / dt)
        self._commanded = min(max(most, SLOWEST), self._commanded + self._acceleration * dt)
        return Velocity2(0.0, math.copysign(self._commanded, self.left)), ManoeuvreState.MOVES


Manoeuvre = BackUpManoeuvre | SpinManoeuvre
