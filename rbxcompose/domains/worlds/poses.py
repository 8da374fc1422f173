"""Planar poses as messages, and the rays of scans."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.base.geometry import Pose2, quaternion_from_rpy, yaw_of
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.sensor_msgs import LaserScan

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]


def pose_in(message: geometry.Pose) -> Pose2:
    """Return the planar part of a pose."""
    at, turn = message.position, message.orientation
    return Pose2(at.x, at.y, yaw_of((turn.x, turn.y, turn.z, turn.w)))


def message_of(pose: Pose2) -> geometry.Pose:
    """Return a planar pose as a message."""
    turn = quaternion_from_rpy(0.0, 0.0, pose.heading)
    return geometry.Pose(geometry.Point(pose.x, pose.y, 0.0), geometry.Quaternion(*turn))


def rays_of(scan: LaserScan) -> tuple[Numbers, Numbers]:
    """Return the angles [rad] and the ranges [m] of a scan as it has them: they may be no numbers."""
    import numpy as np  # robots without a laser need none

    ranges = np.asarray(scan.ranges, np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges), dtype=np.float64)
    return angles, ranges
