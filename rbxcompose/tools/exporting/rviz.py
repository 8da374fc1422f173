"""The configuration of RViz for a robot: a display for each topic that it can show, and tools for those it can send."""

from typing import Any

import yaml

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.sdk.ports import Qos
from rbxcompose.tools.exporting.viewed_topics import ViewedTopic, fixed_frame, heard, sent

DESCRIPTION = "/robot_description"
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
_TOOLS = {  # by the last part of the topic to which they send, and its type
    ("goal_pose", "geometry_msgs/msg/PoseStamped"): "SetGoal",
    ("initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped"): "SetInitialPose",
}


def rviz_config(plan: Plan) -> str:
    """Return the text of the file, for `rviz2 -d`."""
    displays = [
        {"Class": f"rviz_default_plugins/{kind}", "Name": name, "Enabled": True, "Value": True, **rest}
        for kind, name, rest in _shown(plan)
    ]
    view = {"Class": "rviz_default_plugins/Orbit", "Name": "Current View", "Distance": 5, "Pitch": 0.8, "Yaw": 0.8}
    manager = {
        "Class": "",
        "Displays": displays,
        "Enabled": True,
        "Global Options": {"Fixed Frame": fixed_frame(plan), "Frame Rate": 30},
        "Tools": _tools(plan),
        "Views": {"Current": view},
    }
    panels = [{"Class": f"rviz_common/{panel}", "Name": panel} for panel in ("Displays", "Views")]
    return yaml.safe_dump({"Panels": panels, "Visualization Manager": manager}, sort_keys=False)


def _shown(plan: Plan) -> list[tuple[str, str, dict[str, Any]]]:
    shown: list[tuple[str, str, dict[str, Any]]] = [("Grid", "Grid", {})]
    topics = sent(plan)
    if any(topic.type == "tf2_msgs/msg/TFMessage" for topic in topics.values()):
        shown.append(("TF", "Frames", {}))
    for name, topic in topics.items():
        if name.endswith(DESCRIPTION):
            shown.append(("RobotModel", "Robot", {"Description Source": "Topic", "Description Topic": _quality(topic)}))
        elif topic.type in _DISPLAYS:
            shown.append((_DISPLAYS[topic.type], name, {"Topic": _quality(topic)}))
    return shown


def _tools(plan: Plan) -> list[dict[str, Any]]:
    tools: list[dict[str, Any]] = [{"Class": f"rviz_default_plugins/{tool}"} for tool in ("Interact", "MoveCamera")]
    for name, topic in heard(plan).items():
        if (tool := _TOOLS.get((name.rpartition("/")[2], topic.type))) is not None:
            tools.append({"Class": f"rviz_default_plugins/{tool}", "Topic": {"Value": name}})
    return tools


def _quality(topic: ViewedTopic) -> dict[str, Any]:
    """Return a topic as RViz has it, which hears nothing if its wishes are above what is offered."""
    return {
        "Value": topic.name,
        "Depth": topic.qos.depth,
        "History Policy": "Keep Last",
        "Reliability Policy": "Best Effort" if topic.qos is Qos.BULK else "Reliable",
        "Durability Policy": "Transient Local" if topic.qos is Qos.LATCHED else "Volatile",
    }
