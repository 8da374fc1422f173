"""The robot's URDF on the bus."""

from __future__ import annotations

from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk import Component, Config, Out, component


class RobotDescriptionConfig(Config):
    """The description to publish."""

    urdf: str
    """Text of the URDF."""


@component("robot_description")
class RobotDescription(Component[RobotDescriptionConfig]):
    """Publishes the robot's URDF, which viewers and other ROS 2 programs read from this topic.

    Example:
        shape: {type: robot_description, urdf: '<robot name="cart"><link name="base"/></robot>'}
    """

    made_by = "A robot with a `body` runs one."
    robot_description = Out(String, "robot_description", qos="latched")

    def activate(self) -> None:
        """Publish once; late subscribers receive it, too."""
        self.robot_description(String(data=self.config.urdf))
