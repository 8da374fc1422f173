"""Where the odometry of wheels says that a base is, as messages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.bases.wheels import WheelOdometry
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import transform_message
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

UNKNOWN = 1e6  # variance of what wheels cannot measure: height, roll, pitch
PLANAR = (0, 1, 5)  # x, y, and the turn about z, of the six that a covariance has


def odometry_message(known: WheelOdometry, header: Header, child: str) -> Odometry:
    """Return where a base is in the frame of `header`, and how its frame `child` moves."""
    place, velocity = _place(known), known.velocity
    at = place.translation
    pose = geometry.Pose(position=geometry.Point(at.x, at.y, at.z), orientation=place.rotation)
    twist = geometry.Twist(linear=geometry.Vector3(x=velocity.linear), angular=geometry.Vector3(z=velocity.angular))
    spread = np.zeros((3, 3))
    spread[np.ix_((0, 2), (0, 2))] = known.velocity_covariance  # a wheel does not slip sideways
    return Odometry(
        header=header,
        child_frame_id=child,
        pose=geometry.PoseWithCovariance(pose=pose, covariance=planar(known.covariance)),
        twist=geometry.TwistWithCovariance(twist=twist, covariance=planar(spread)),
    )


def odometry_transform(known: WheelOdometry, header: Header, child: str) -> TFMessage:
    """Return the same place as a transform."""
    link = geometry.TransformStamped(header=header, child_frame_id=child, transform=_place(known))
    return TFMessage(transforms=(link,))


def _place(known: WheelOdometry) -> geometry.Transform:
    return transform_message(Transform3.from_pose2(known.pose))


def planar(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the 36 numbers of a covariance of x, y and the turn about z; the others are unknown."""
    whole = np.diag([UNKNOWN] * 6)
    whole[np.ix_(PLANAR, PLANAR)] = covariance
    return whole.ravel()
