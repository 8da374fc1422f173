"""Packages for a ROS 2 workspace: the messages that ROS 2 lacks, and for each robot what views it there.

`ros2 launch ROBOT_view view.launch.py` starts RViz, with a display for each topic that it can show, or Foxglove's
bridge. ROS 2 reaches the robot's router by `rmw_zenoh_cpp`; the launch file sets the environment for that.
"""

from collections.abc import Sequence
from typing import Any

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs import registry
from rbxcompose.msgs.packages import OWN, own_packages, package_files
from rbxcompose.tools.exporting.viewers import rviz_config, sent

LICENCE = "Apache-2.0"
_LAUNCH = '''"""View {robot}: `ros2 launch {package} view.launch.py`; with `viewer:=foxglove` for Foxglove."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

TOPICS = {topics}


def is_chosen(viewer):
    return IfCondition(PythonExpression(["'", LaunchConfiguration("viewer"), "' == '", viewer, "'"]))


def generate_launch_description():
    router = LaunchConfiguration("router")
    config = PathJoinSubstitution([FindPackageShare("{package}"), "rviz", "{robot}.rviz"])
    return LaunchDescription([
        DeclareLaunchArgument("viewer", default_value="rviz", choices=["rviz", "foxglove"]),
        DeclareLaunchArgument("router", default_value="{router}", description="as `rbxcompose ps` shows it"),
        SetEnvironmentVariable("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"),
        SetEnvironmentVariable("ROS_DOMAIN_ID", "{domain}"),
        SetEnvironmentVariable("ZENOH_CONFIG_OVERRIDE", ['connect/endpoints=["', router, '"]']),
        Node(package="rviz2", executable="rviz2", arguments=["-d", config], condition=is_chosen("rviz")),
        Node(
            package="foxglove_bridge",
            executable="foxglove_bridge",
            parameters=[{{"address": "127.0.0.1", "topic_whitelist": TOPICS}}],
            condition=is_chosen("foxglove"),
        ),
    ])
'''
_XML = """<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>{version}</version>
  <description>Views the robot {robot} in RViz or Foxglove.</description>
  <maintainer email="rbxcompose@example.org">rbxcompose</maintainer>
  <license>{licence}</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <exec_depend>foxglove_bridge</exec_depend>
  <exec_depend>launch_ros</exec_depend>
  <exec_depend>{own}</exec_depend>
  <exec_depend>rmw_zenoh_cpp</exec_depend>
  <exec_depend>ros2launch</exec_depend>
  <exec_depend>rviz2</exec_depend>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""
_CMAKE = """cmake_minimum_required(VERSION 3.8)
project({package})
find_package(ament_cmake REQUIRED)
install(DIRECTORY launch rviz DESTINATION share/${{PROJECT_NAME}})
ament_package()
"""


def packages(plans: Sequence[Plan], version: str) -> dict[str, str]:
    """Return the files of all packages by their paths in the workspace's folder `src`."""
    found = {f"{OWN}/{name}": text for name, text in package_files(OWN, version, LICENCE).items()}
    for plan in plans:
        with registry.choosing(plan.messages):
            for own in own_packages():
                found |= {f"{own}/{name}": text for name, text in package_files(own, version, LICENCE).items()}
        found |= {f"{plan.robot}_view/{name}": text for name, text in _view(plan, version).items()}
    return found


def _view(plan: Plan, version: str) -> dict[str, str]:
    words: dict[str, Any] = {"robot": plan.robot, "package": f"{plan.robot}_view", "version": version, "own": OWN}
    words |= {"licence": LICENCE, "router": plan.bus.router or tcp_endpoint(plan.bus.port), "domain": plan.bus.domain}
    listed = "".join(f'    "{topic}",\n' for topic in sorted({*sent(plan), "/diagnostics", "/rosout"}))
    return {
        "package.xml": _XML.format(**words),
        "CMakeLists.txt": _CMAKE.format(**words),
        "launch/view.launch.py": _LAUNCH.format(**words, topics=f"[\n{listed}]"),
        f"rviz/{plan.robot}.rviz": rviz_config(plan),
    }
