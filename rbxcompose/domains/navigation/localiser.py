"""What every localiser shares: it places `odom` in `map` and publishes the pose as AMCL does."""

from __future__ import annotations

import math
from typing import TypeVar

from rbxcompose import sdk
from rbxcompose.base.arrays import Array, np
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.domains.worlds.poses import message_of, pose_in
from rbxcompose.domains.worlds.world import MAP_FRAME
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.poses import transform_message
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

ODOM, BASE = "odom", "base_footprint"
AHEAD = 200_000_000  # [ns] for which a transform holds in advance, so that scans of now have one, as in AMCL
GIVEN = 0.5, math.radians(15)  # standard deviations of a pose that comes without any [m], [rad]
PLANAR = np.ix_((0, 1, 5), (0, 1, 5))  # x, y and heading in a covariance of six
C = TypeVar("C", bound=sdk.Config)


class Localiser(sdk.Component[C]):
    """Publishes where `odom` is in `map`, and where the robot is."""

    tf = sdk.Out(TFMessage, "/tf")
    estimate = sdk.Out(geometry.PoseWithCovarianceStamped, "amcl_pose", qos="latched")

    @classmethod
    def capabilities(cls, config: C) -> tuple[sdk.Capability, ...]:
        """Declare the frame that it places."""
        return (*super().capabilities(config), sdk.WritesFrame("tf", sdk.Setting(MAP_FRAME), sdk.Setting(ODOM)))

    def place(self, correction: Pose2) -> None:
        """Publish where `odom` is in `map`, for now and a little later."""
        transform = transform_message(Transform3.from_pose2(correction))
        header = Header(stamp=to_time(self.stamp + AHEAD), frame_id=MAP_FRAME)
        self.tf(TFMessage(transforms=(geometry.TransformStamped(header, ODOM, transform),)))

    def publish_pose(self, pose: Pose2, covariance: Array, stamp: Time) -> None:
        """Publish where the robot was at a stamp, with the covariance of x, y [m^2] and heading [rad^2] (3, 3)."""
        spread = np.zeros((6, 6))
        spread[PLANAR] = covariance
        known = geometry.PoseWithCovariance(message_of(pose), spread.ravel())
        self.estimate(geometry.PoseWithCovarianceStamped(Header(stamp, MAP_FRAME), known))


def given_pose(message: geometry.PoseWithCovarianceStamped) -> tuple[Pose2, float, float]:
    """Return a pose that somebody pointed at in a viewer, and its standard deviations [m, rad]."""
    covariance = np.asarray(message.pose.covariance, float).reshape(6, 6)
    spread, turn_spread = math.sqrt(max(0.0, covariance[0, 0])), math.sqrt(max(0.0, covariance[5, 5]))
    return pose_in(message.pose.pose), spread or GIVEN[0], turn_spread or GIVEN[1]
