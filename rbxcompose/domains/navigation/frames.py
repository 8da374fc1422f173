"""The frames of a robot that is localised, and how `odom` is placed in `map`."""

from __future__ import annotations

from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.domains.worlds.world import MAP_FRAME
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.poses import transform_message
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

ODOM, BASE = "odom", "base_footprint"
AHEAD = 200_000_000  # [ns] for which a transform holds in advance, so that scans of now have one, as in AMCL


def odom_in_map(correction: Pose2, stamp: int) -> TFMessage:
    """Return where `odom` is in `map` at a stamp [ns], and a little later."""
    transform = transform_message(Transform3.from_pose2(correction))
    header = Header(stamp=to_time(stamp + AHEAD), frame_id=MAP_FRAME)
    return TFMessage(transforms=(geometry.TransformStamped(header, ODOM, transform),))
