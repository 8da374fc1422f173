"""Fixed frames."""

from __future__ import annotations

from rbxcompose.msgs.geometry_msgs import Quaternion, Transform, TransformStamped
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk import Capability, Component, Config, Out, Setting, WritesFrame, component


class TransformsConfig(Config):
    """The frames that coincide."""

    map: str = "map"
    """Frame of places."""
    odom: str = "odom"
    """Frame of the base's odometry."""


@component("transforms")
class Transforms(Component[TransformsConfig]):
    """Publishes the frames that never move. While nothing localises the robot, `odom` coincides with `map`.

    Example:
        frames: {type: transforms, map: building, odom: map}
    """

    made_by = "Every robot runs one."
    tf_static = Out(TFMessage, "/tf_static", qos="latched")

    @classmethod
    def capabilities(cls, config: TransformsConfig) -> tuple[Capability, ...]:
        """Declare the frame that it fixes."""
        return (WritesFrame("tf_static", Setting(config.map, "map"), Setting(config.odom, "odom")),)

    def activate(self) -> None:
        """Publish once; late subscribers receive it, too."""
        link = TransformStamped(
            header=Header(stamp=to_time(self.stamp), frame_id=self.config.map),
            child_frame_id=self.config.odom,
            transform=Transform(rotation=Quaternion(w=1.0)),
        )
        self.tf_static(TFMessage(transforms=(link,)))
