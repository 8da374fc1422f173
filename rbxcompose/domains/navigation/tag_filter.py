"""Where a robot is in a map, by tags of known places and odometry: an extended Kalman filter.

As S. Thrun, W. Burgard and D. Fox, Probabilistic Robotics (2005), section 7.4, with the place of a tag and its
direction in place of the range and the bearing of a landmark. The innovation gate is that of section 7.5.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, wrap_angle

Numbers = NDArray[np.float64]

WAY, WAY_TURN, TURN = 0.05, 0.05, 0.05  # errors of odometry [m/m], [rad/m], [rad/rad]
ERROR, TURN_ERROR = 0.01, math.radians(1.5)  # [m], [rad] that a tag is elsewhere than its place says
GATE = {2: 13.8, 3: 16.3}  # squared Mahalanobis distances that 999 of 1000 keep, by the number of values
SURE = 5  # pictures that agree on another place, after which the robot is there
AGREE, TURN_AGREE = 0.3, 0.3  # [m], [rad] between places that agree
UNKNOWN = 1e3  # variance of what is not known


@dataclass(frozen=True, slots=True, eq=False)
class PlacedTag:
    """A tag as it was seen."""

    name: str
    pose: Pose2
    """Its place in the frame of the robot, and the direction out of it."""
    covariance: Numbers
    """Of x, y [m^2] and direction [rad^2] (3, 3)."""
    is_square: bool = True
    """Whether it is known how it is turned."""


class TagFilter:
    """The pose of a robot in `map`; unknown until a tag was seen squarely, unless it starts somewhere."""

    def __init__(self, tags: dict[str, Pose2]) -> None:
        """Know where tags are in `map`, with the direction out of each."""
        self.tags = tags
        self.pose: Pose2 | None = None
        self.covariance: Numbers = np.eye(3) * UNKNOWN
        self.rejected = 0
        """Tags that were not where they should be, one after the other."""
        self._odometry: Pose2 | None = None
        self._elsewhere: Pose2 | None = None  # where those have the robot

    @property
    def correction(self) -> Pose2 | None:
        """Return where `odom` is in `map`."""
        if self.pose is None or self._odometry is None:
            return None
        return self.pose.compose(self._odometry.inverse())

    @property
    def error(self) -> float:
        """Return the standard deviation of the place [m]."""
        return math.sqrt(float(np.linalg.eigvalsh(self.covariance[:2, :2])[-1]))

    def start(self, pose: Pose2, spread: float, turn_spread: float) -> None:
        """Begin around a pose, with standard deviations [m, rad]."""
        self.pose, self.covariance = pose, np.diag((spread**2, spread**2, turn_spread**2))
        self.rejected, self._elsewhere = 0, None

    def move(self, odometry: Pose2) -> None:
        """Take where odometry has the robot."""
        before, self._odometry = self._odometry, odometry
        if before is None:
            return
        step = before.inverse().compose(odometry)
        if self._elsewhere is not None:
            self._elsewhere = self._elsewhere.compose(step)
        if self.pose is None:
            return
        way = math.hypot(step.x, step.y)
        cos, sin = math.cos(self.pose.heading), math.sin(self.pose.heading)
        slope = np.eye(3)
        slope[0, 2], slope[1, 2] = -sin * step.x - cos * step.y, cos * step.x - sin * step.y
        spread = (WAY * way) ** 2
        turned = (WAY_TURN * way) ** 2 + (TURN * step.heading) ** 2
        self.covariance = slope @ self.covariance @ slope.T + np.diag((spread, spread, turned))
        self.pose = self.pose.compose(step)

    def see(self, seen: PlacedTag) -> bool:
        """Take a tag that is seen from where odometry has the robot; return whether it is where it should be."""
        if (tag := self.tags.get(seen.name)) is None:
            return False
        noise = seen.covariance + np.diag((ERROR**2, ERROR**2, TURN_ERROR**2))
        if self.pose is None:
            if seen.is_square:
                self._begin(tag, seen, noise)
            return seen.is_square
        cos, sin = math.cos(self.pose.heading), math.sin(self.pose.heading)
        dx, dy = tag.x - self.pose.x, tag.y - self.pose.y
        expected = np.array((cos * dx + sin * dy, cos * dy - sin * dx, tag.heading - self.pose.heading))
        slope = np.array(((-cos, -sin, expected[1]), (sin, -cos, -expected[0]), (0.0, 0.0, -1.0)))
        error = np.array((seen.pose.x, seen.pose.y, seen.pose.heading)) - expected
        error[2] = wrap_angle(error[2])
        known = 3 if seen.is_square else 2
        error, slope, noise = error[:known], slope[:known], noise[:known, :known]
        spread = slope @ self.covariance @ slope.T + noise
        if float(error @ np.linalg.solve(spread, error)) > GATE[known]:
            self._doubt(tag, seen, noise)
            return False
        gain = self.covariance @ slope.T @ np.linalg.inv(spread)
        x, y, heading = (gain @ error).tolist()
        self.pose = Pose2(self.pose.x + x, self.pose.y + y, wrap_angle(self.pose.heading + heading))
        self.covariance = (np.eye(3) - gain @ slope) @ self.covariance
        self.covariance = (self.covariance + self.covariance.T) / 2
        self.rejected, self._elsewhere = 0, None
        return True

    def _begin(self, tag: Pose2, seen: PlacedTag, noise: Numbers) -> None:
        """Be where a tag has the robot: what is not known of the tag, is not known of the robot."""
        pose = tag.compose(seen.pose.inverse())
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        x, y = seen.pose.x, seen.pose.y
        # The robot is at the tag, less its place turned by a heading that is as wrong as the direction of the tag.
        slope = np.array(((-cos, sin, -sin * x - cos * y), (-sin, -cos, cos * x - sin * y), (0.0, 0.0, -1.0)))
        self.pose, self.covariance = pose, slope @ noise @ slope.T
        self.rejected, self._elsewhere = 0, None

    def _doubt(self, tag: Pose2, seen: PlacedTag, noise: Numbers) -> None:
        """Count tags that have the robot at one place which is another than believed, and go there after a few."""
        self.rejected += 1
        if not seen.is_square:
            return
        there, last = tag.compose(seen.pose.inverse()), self._elsewhere
        self._elsewhere = there
        if last is None or last.distance(there) > AGREE or abs(wrap_angle(last.heading - there.heading)) > TURN_AGREE:
            self.rejected = 1
        elif self.rejected >= SURE:
            self._begin(tag, seen, noise)
