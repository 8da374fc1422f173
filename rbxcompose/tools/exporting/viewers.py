"""What viewers of ROS show of a robot: its topics, as a configuration of RViz and as a layout of Foxglove."""

import json
from collections.abc import Iterator, Mapping
from operator import itemgetter
from typing import Any

import yaml

from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.plan.teleoperation import teleoperated
from rbxcompose.sdk.capabilities import Capability, Drains, Drives, WritesFrame
from rbxcompose.sdk.ports import In, Out, Qos
from rbxcompose.sdk.registry import component_type, declared

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
SPEED, TURN_RATE = 0.3, 0.8  # [m/s, rad/s] of the buttons at most
SEND_RATE = 10  # [Hz], while a button is held
_IN_SCENE = {
    "geometry_msgs/msg/PoseArray",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/OccupancyGrid",
    "nav_msgs/msg/Path",
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/PointCloud2",
    "visualization_msgs/msg/Marker",
    "visualization_msgs/msg/MarkerArray",
}
_PICTURES = {"sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image"}
Panel = tuple[str, dict[str, Any]]


@dataclass(frozen=True, slots=True)
class ViewedTopic:
    """A topic of a robot."""

    name: str
    type: str
    qos: Qos


@dataclass(frozen=True, slots=True)
class DrivenTopic:
    """A topic at which a person may drive, and what the base takes at most [m/s, rad/s]."""

    name: str
    speed: float
    turn_rate: float


def sent(plan: Plan) -> dict[str, ViewedTopic]:
    """Return the topics that the robot sends, by their names."""
    return _topics(plan, Out)


def heard(plan: Plan) -> dict[str, ViewedTopic]:
    """Return the topics that the robot listens to, by their names."""
    return _topics(plan, In)


def _topics(plan: Plan, kind: type[In[Any]] | type[Out[Any]]) -> dict[str, ViewedTopic]:
    found = (
        (wire.topic, ViewedTopic(wire.topic, port.interface.TYPE if port.interface else "", port.qos))
        for instance in plan.everywhere
        for ports in (plan.ports(instance),)
        for wire in instance.wires
        if isinstance(port := ports.get(wire.port), kind) and wire.topic
    )
    return dict(sorted(found, key=itemgetter(0)))


def fixed_frame(plan: Plan) -> str:
    """Return the frame that no other is the parent of."""
    frames = [each for _, each in _declared(plan) if isinstance(each, WritesFrame)]
    written = {each.child.value: each.parent.value for each in frames}
    roots = [parent for parent in written.values() if parent not in written]
    return roots[0] if roots else "base_link"


def levels(plan: Plan) -> list[str]:
    """Return the topics with the charge of each battery, a number in the field `data`."""
    return [topic_of(each.level) for topic_of, each in _declared(plan) if isinstance(each, Drains)]


def driven(plan: Plan) -> DrivenTopic | None:
    """Return where a person may drive by velocities: the first of the topics at which `rbxcompose drive` would."""
    for name, topic in teleoperated(plan).items():
        [base] = [instance for instance in plan.everywhere if instance.name == name]
        for drives in declared(base.type, base.config, Drives):
            speeds = (drives.max_speed, drives.max_turn_rate)
            return DrivenTopic(topic, *(1.0 if most is None else most.value for most in speeds))
    return None


def _declared(plan: Plan) -> Iterator[tuple[Any, Capability]]:
    """Yield each capability, with what returns the topic at a port of its component."""
    for instance in plan.everywhere:
        for each in component_type(instance.type).capabilities(instance.config):
            yield instance.topic, each


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


def foxglove_layout(plan: Plan) -> str:
    """Return the text of the file, for "Import from file" in the menu of layouts."""
    scene, pictures, rest = ("3D!scene", _scene(plan)), list(_pictures(plan)), list(_rest(plan))
    left = _stacked([scene[0], *(name for name, _ in pictures)], "column")
    layout: dict[str, Any] | str = left
    if rest:
        right = _stacked([name for name, _ in rest], "column")
        layout = {"direction": "row", "first": left, "second": right, "splitPercentage": 60}
    made = {
        "configById": dict([scene, *pictures, *rest]),
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": layout,
    }
    return json.dumps(made, indent=2) + "\n"


def _stacked(names: list[str], direction: str) -> dict[str, Any] | str:
    """Return a tree of panels of one size, one below the other."""
    first, *others = names
    if not others:
        return first
    share = round(100 / len(names), 1)
    return {"direction": direction, "first": first, "second": _stacked(others, direction), "splitPercentage": share}


def _scene(plan: Plan) -> dict[str, Any]:
    shown = [topic for topic in sent(plan).values() if topic.type in _IN_SCENE or topic.name.endswith(DESCRIPTION)]
    return {
        "followMode": "follow-none",
        "followTf": fixed_frame(plan),
        "layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "visible": True}},
        "topics": {topic.name: {"visible": True} for topic in shown},
        **_clicks(plan),
    }


def _clicks(plan: Plan) -> dict[str, Any]:
    """Return to which topics a click into the scene sends, of those that the robot listens to."""
    keys = {"goal_pose": "poseTopic", "initialpose": "poseEstimateTopic"}
    found = {keys[last]: name for name in heard(plan) if (last := name.rpartition("/")[2]) in keys}
    return {"publish": {"type": "pose" if "poseTopic" in found else "pose_estimate", **found}} if found else {}


def _pictures(plan: Plan) -> Iterator[Panel]:
    for topic in sent(plan).values():
        if topic.type in _PICTURES:
            mode = {"imageTopic": topic.name}
            yield f"Image!{_id(topic.name)}", {"imageMode": mode, "foxglovePanelTitle": topic.name}


def _rest(plan: Plan) -> Iterator[Panel]:
    if levels(plan):
        yield "Plot!battery", _plot("Battery", {f"{topic}.data": topic for topic in levels(plan)})
    topics = sent(plan)
    for topic in topics.values():
        if topic.type == "nav_msgs/msg/Odometry":
            speeds = {"linear.x": "forwards [m/s]", "angular.z": "turning [rad/s]"}
            paths = {f"{topic.name}.twist.twist.{field}": words for field, words in speeds.items()}
            yield f"Plot!{_id(topic.name)}", _plot(topic.name, paths)
        elif topic.type == "sensor_msgs/msg/JointState" and topic.name.endswith("/joint_states"):
            paths = {f"{topic.name}.position[:]": "position"}
            yield f"Plot!{_id(topic.name)}", _plot(topic.name, paths, arrayExpansion="byIndex")
    for name, topic in {**heard(plan), **topics}.items():
        if topic.type == "diagnostic_msgs/msg/DiagnosticArray" and name.endswith("/diagnostics"):
            yield f"DiagnosticSummary!{_id(name)}", {"minLevel": 0, "pinnedIds": [], "topicToRender": name}
    if (drive := driven(plan)) is not None:
        yield "Teleop!drive", _teleop(drive.name, min(SPEED, drive.speed), min(TURN_RATE, drive.turn_rate))


def _plot(title: str, paths: Mapping[str, str], **more: str) -> dict[str, Any]:
    series = [
        {"value": path, "label": label, "enabled": True, "timestampMethod": "receiveTime", **more}
        for path, label in paths.items()
    ]
    return {"foxglovePanelTitle": title, "paths": series, "showLegend": True, "xAxisVal": "timestamp"}


def _teleop(topic: str, speed: float, turn_rate: float) -> dict[str, Any]:
    buttons = {
        "upButton": ("linear-x", speed),
        "downButton": ("linear-x", -speed),
        "leftButton": ("angular-z", turn_rate),
        "rightButton": ("angular-z", -turn_rate),
        "stopButton": ("linear-x", 0.0),
    }
    made = {button: {"field": field, "value": round(value, 3)} for button, (field, value) in buttons.items()}
    return {"topic": topic, "publishRate": SEND_RATE, **made, "autoSendStopOnRelease": True}


def _id(topic: str) -> str:
    return topic.strip("/").replace("/", "_")
