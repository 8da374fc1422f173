"""Packages for a ROS 2 workspace: the messages that ROS 2 lacks, and for each robot what views it there.

`ros2 launch ROBOT_view view.launch.py` starts RViz, with a display for each topic that it can show, or Foxglove's
bridge. ROS 2 reaches the robot's router by `rmw_zenoh_cpp`; the launch file sets the environment for that.
"""

from collections.abc import Iterator
from operator import itemgetter
from typing import Any

import yaml

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs import registry
from rbxcompose.msgs.packages import OWN, own_packages, package_files
from rbxcompose.sdk.capabilities import WritesFrame
from rbxcompose.sdk.ports import Out, Qos
from rbxcompose.sdk.registry import component_type

LICENCE = "Apache-2.0"
_DISPLAYS = {
    "geometry_msgs/msg/PointStamped": "PointStamped",
    "geometry_msgs/msg/PolygonStamped": "Polygon",
    "geometry_msgs/msg/PoseArray": "PoseArray",
    "geometry_msgs/msg/PoseStamped": "Pose",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "PoseWithCovariance",
    "geometry_msgs/msg/TwistStamped": "TwistStamped",
    "nav_msgs/msg/OccupancyGrid": "Map",
    "nav_msgs/msg/Odometry": "Odometry",
    "nav_msgs/msg/Path": "Path",
    "sensor_msgs/msg/Image": "Image",
    "sensor_msgs/msg/LaserScan": "LaserScan",
    "sensor_msgs/msg/PointCloud2": "PointCloud2",
    "sensor_msgs/msg/Range": "Range",
    "visualization_msgs/msg/Marker": "Marker",
    "visualization_msgs/msg/MarkerArray": "MarkerArray",
}
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


def packages(plans: list[Plan], version: str) -> dict[str, str]:
    """Return the files of all packages by their paths in the workspace's folder `src`."""
    found = {f"{OWN}/{name}": text for name, text in package_files(OWN, version, LICENCE).items()}
    for plan in plans:
        with registry.choosing(plan.messages):
            for own in own_packages():
                found |= {f"{own}/{name}": text for name, text in package_files(own, version, LICENCE).items()}
        found |= {f"{plan.robot}_view/{name}": text for name, text in _view(plan, version).items()}
    return found


def _view(plan: Plan, version: str) -> dict[str, str]:
    topics = dict(sorted(_topics(plan), key=itemgetter(0)))
    words: dict[str, Any] = {"robot": plan.robot, "package": f"{plan.robot}_view", "version": version, "own": OWN}
    words |= {"licence": LICENCE, "router": plan.bus.router or tcp_endpoint(plan.bus.port), "domain": plan.bus.domain}
    listed = "".join(f'    "{topic}",\n' for topic in sorted({*topics, "/diagnostics", "/rosout"}))
    return {
        "package.xml": _XML.format(**words),
        "CMakeLists.txt": _CMAKE.format(**words),
        "launch/view.launch.py": _LAUNCH.format(**words, topics=f"[\n{listed}]"),
        f"rviz/{plan.robot}.rviz": yaml.safe_dump(_rviz(plan, topics), sort_keys=False),
    }


def _topics(plan: Plan) -> Iterator[tuple[str, Out[Any]]]:
    for instance in plan.everywhere:
        ports = component_type(instance.type).ports(instance.config)
        for wire in instance.wires:
            if isinstance(port := ports.get(wire.port), Out) and wire.topic:
                yield wire.topic, port


def _rviz(plan: Plan, topics: dict[str, Out[Any]]) -> dict[str, Any]:
    shown: list[tuple[str, str, dict[str, Any]]] = [("Grid", "Grid", {}), ("TF", "Frames", {})]
    for topic, port in topics.items():
        type_ = port.interface.TYPE if port.interface else ""
        if topic.endswith("/robot_description"):
            given = {"Description Source": "Topic", "Description Topic": _topic(topic, port)}
            shown.append(("RobotModel", "Robot", given))
        elif type_ in _DISPLAYS:
            shown.append((_DISPLAYS[type_], topic, {"Topic": _topic(topic, port)}))
    displays = [
        {"Class": f"rviz_default_plugins/{kind}", "Name": name, "Enabled": True, "Value": True, **rest}
        for kind, name, rest in shown
    ]
    view = {"Class": "rviz_default_plugins/Orbit", "Name": "Current View", "Distance": 5, "Pitch": 0.8, "Yaw": 0.8}
    manager = {
        "Class": "",
        "Displays": displays,
        "Enabled": True,
        "Global Options": {"Fixed Frame": _fixed_frame(plan), "Frame Rate": 30},
        "Tools": [{"Class": f"rviz_default_plugins/{tool}"} for tool in ("Interact", "MoveCamera", "SetGoal")],
        "Views": {"Current": view},
    }
    panels = [{"Class": f"rviz_common/{panel}", "Name": panel} for panel in ("Displays", "Views")]
    return {"Panels": panels, "Visualization Manager": manager}


def _topic(topic: str, port: Out[Any]) -> dict[str, Any]:
    """Return a topic as RViz has it, which hears nothing if its wishes are above what is offered."""
    return {
        "Value": topic,
        "Depth": port.qos.depth,
        "History Policy": "Keep Last",
        "Reliability Policy": "Best Effort" if port.qos is Qos.BULK else "Reliable",
        "Durability Policy": "Transient Local" if port.qos is Qos.LATCHED else "Volatile",
    }


def _fixed_frame(plan: Plan) -> str:
    """Return the frame that no other is the parent of."""
    capabilities = (
        each for instance in plan.everywhere for each in component_type(instance.type).capabilities(instance.config)
    )
    written = {each.child.value: each.parent.value for each in capabilities if isinstance(each, WritesFrame)}
    roots = [parent for parent in written.values() if parent not in written]
    return roots[0] if roots else "base_link"
