"""A frame as a target."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.levels import Level
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.poses import pose_message
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header


class FrameTargetConfig(sdk.Config):
    """Which frame."""

    frame: str = Field(min_length=1)
    """The frame that is the target."""
    stands_in: str = "base_footprint"
    """The frame in which it is told where that is."""
    rate: sdk.Frequency = Field(20.0, gt=0, le=200)
    """How often it is told."""


@sdk.component("frame_target")
class FrameTarget(sdk.Component[FrameTargetConfig]):
    """Publishes where a frame is, such as that of a hand, for what follows poses on a topic.

    Example:
        target: {type: frame_target, frame: right_gripper_link, stands_in: base_link}
    """

    target = sdk.Out(PoseStamped, "target_pose", qos="command")

    @classmethod
    def rate_of(cls, config: FrameTargetConfig) -> float:
        """Return how often it tells where the frame is [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: FrameTargetConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with a look at the frame."""
        return super().ports(config) | {"at": sdk.Looks(source=config.frame, target=config.stands_in).named("at")}

    def step(self, dt: float) -> None:
        """Publish where the frame is, if that is known."""
        try:
            at = self.bound["at"].transform()
        except LookupError as error:
            self.status(Level.WARN, str(error))
            return
        self.status(Level.OK, "is told")
        header = Header(stamp=to_time(self.stamp), frame_id=self.config.stands_in)
        self.target(PoseStamped(header, pose_message(at)))
