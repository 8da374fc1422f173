"""Where the tip of an arm should be while it follows a point.

The four distances are those of `arm_tracker` in "ROS By Example, Volume 2" by R. Patrick Goebel. Points are in the
frame of the link that carries the arm, lengths in [m], times are robot time [s].
"""

from __future__ import annotations

import math
from enum import StrEnum

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Quaternion, Vector3, quaternion_from_rpy


class Chase(StrEnum):
    """What an arm does while it follows a point."""

    WAITING = "waiting"  # no point has come yet, or lately
    FOLLOWING = "following"
    THERE = "there"
    FAR = "far"  # the point is beyond what the arm cares for: it rests


@dataclass(frozen=True, slots=True)
class PursuitSettings:
    """The distances: `length` of the arm from its shoulder, of which it uses a `share`."""

    length: float
    share: float = 0.9
    moved: float = 0.01
    """What moved by less is where it was."""
    close: float = 0.025
    """The tip is there when it is nearer than this."""
    farthest: float = 1.2
    """Beyond this, from the shoulder, the arm rests."""


class Pursuit:
    """Follows a point; `shoulder` is where the arm begins."""

    def __init__(self, settings: PursuitSettings, shoulder: Vector3, now: float) -> None:
        self.state, self.goal, self.distance = Chase.WAITING, shoulder, math.inf
        self._settings, self._shoulder = settings, shoulder
        self._seen: Vector3 | None = None
        self._at = now

    def see(self, now: float, point: Vector3) -> None:
        """Take where the point is now."""
        self._at = now
        if self._seen is None or math.dist(self._seen, point) >= self._settings.moved:
            self._seen = point
            self.goal = self._within(point)
            self.state = Chase.FAR if math.dist(point, self._shoulder) > self._settings.farthest else Chase.FOLLOWING

    def is_lost(self, now: float, patience: float) -> bool:
        """Return whether no point has come for so long."""
        return now - self._at > patience

    def next(self, tip: Vector3) -> tuple[Vector3, Quaternion] | None:
        """Return where the tip should go, pointing away from the shoulder; None if it should not move."""
        self.distance = math.dist(tip, self.goal)
        if self.state is not Chase.FOLLOWING:
            return None
        if self.distance <= self._settings.close:
            self.state = Chase.THERE
            return None
        x, y, z = (to - at for to, at in zip(self.goal, self._shoulder, strict=True))
        return self.goal, quaternion_from_rpy(0.0, -math.atan2(z, math.hypot(x, y)), math.atan2(y, x))

    def _within(self, point: Vector3) -> Vector3:
        """Return the point, or the one in its direction that is as far as the arm should reach."""
        away = math.dist(point, self._shoulder)
        share = min(1.0, self._settings.share * self._settings.length / max(away, 1e-9))
        x, y, z = (at + (to - at) * share for to, at in zip(point, self._shoulder, strict=True))
        return (x, y, z)
