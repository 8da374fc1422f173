"""A layout of Foxglove and Lichtblick for a robot: its scene, pictures, plots, diagnostics, and a way to drive it."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.tools.exporting.rviz import DESCRIPTION
from rbxcompose.tools.exporting.viewed_topics import driven, fixed_frame, heard, levels, sent

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
            yield (
                f"Image!{_id(topic.name)}",
                {"imageMode": {"imageTopic": topic.name}, "foxglovePanelTitle": topic.name},
            )


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
