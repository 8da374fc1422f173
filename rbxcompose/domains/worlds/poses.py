"""Planar poses as messages, the rays of scans, and messages of sensors with the poses at which they measured."""

from __future__ import annotations

import math
from typing import Generic, Protocol, TypeVar

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.msgs.geometry_msgs import Pose
from rbxcompose.msgs.poses import pose_message, pose_of
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import Look


def pose_in(message: Pose) -> Pose2:
    """Return the planar part of a pose."""
    return pose_of(message).to_pose2()


def message_of(pose: Pose2) -> Pose:
    """Return a planar pose as a message."""
    return pose_message(Transform3.from_pose2(pose))


def rays_of(scan: LaserScan) -> tuple[Array, Array]:
    """Return the angles [rad] and the ranges [m] of a scan as it has them: they may be no numbers."""
    ranges = np.asarray(scan.ranges, np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges), dtype=np.float64)
    return angles, ranges


LATE = 0.3  # [s] that a transform may come later than what was measured at its time


class WithHeader(Protocol):
    """A message with a header."""

    @property
    def header(self) -> Header:
        """Return when and in which frame it was measured."""
        ...


M = TypeVar("M", bound=WithHeader)


class NewestMessage(Generic[M]):
    """The newest message of a sensor, until it is known where that was when it measured.

    Transforms of that time may come later than the message, so that they are missing is a problem only if it lasts.
    """

    def __init__(self, frame: str = "", wrong: str = "it is in '{}', not in '{}'") -> None:
        """Take messages in a frame, or in any; `wrong` says what is wrong with those in another one."""
        self._frame, self._wrong = frame, wrong
        self._message: M | None = None
        self._waits = math.inf  # since when transforms have been missing [s]
        self.problem = ""
        """Why it cannot be used so far."""

    def put(self, message: M) -> None:
        """Take a message in place of the one before."""
        self._message = message

    def take(self, now: float, *looks: Look) -> tuple[M, list[Transform3]] | None:
        """Return the message with the poses of frames at its time, once; None as long as there is none [s]."""
        if (message := self._message) is None:
            return None
        frame, stamp = message.header.frame_id.lstrip("/"), to_nanoseconds(message.header.stamp) or None
        if self._frame and frame not in ("", self._frame):
            self.problem = self._wrong.format(frame, self._frame)
            return None
        try:
            poses = [look.transform(at=stamp) for look in looks]
        except LookupError as error:
            self._waits = min(self._waits, now)
            if now - self._waits >= LATE:
                self.problem = str(error)
            return None
        self._message, self._waits, self.problem = None, math.inf, ""
        return message, poses
