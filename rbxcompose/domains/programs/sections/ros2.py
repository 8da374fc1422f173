"""The section `ros2`: the ROS 2 of this robot."""

from rbxcompose.domains.programs.bridge.installation import RosModel
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading


@section("ros2", RosModel, order=30)
def ros2(reading: Reading[RosModel]) -> RosModel | None:
    """Where ROS 2 is, for the components of type `ros2_node`.

    Example:
        ros2:
          setup: /opt/ros/kilted/setup.bash
          domain: 3
    """
    return reading.whole()
