"""What two instances of a part have in common: topics and services whose names do not contain theirs."""

from __future__ import annotations

from rbxcompose.composition.robot_manifest import IncludedPart
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.qos import Qos
from rbxcompose.sdk.ports import Out, Serves, ServesAction, ServesTopic


def answers(end: PortEnd) -> bool:
    """Return whether a client of this end waits for an answer; an order whose end is not reported may go to several."""
    return isinstance(end.port, Serves | ServesAction) or (isinstance(end.port, ServesTopic) and bool(end.port.ends))


def part_of(robot: Robot, component: str) -> IncludedPart | None:
    """Return the outermost instance that brings a component, None if the robot itself lists it."""
    found = [part for part in robot.manifest.parts.values() if component in part.components]
    return min(found, key=lambda part: part.name.count("."), default=None)


def shared_names(robot: Robot, part: IncludedPart, other: IncludedPart) -> dict[str, str]:
    """Return what both instances publish or serve, by topic: its name in the part, which `connect` takes."""
    theirs = _told(robot, other)
    return {topic: name for topic, name in _told(robot, part).items() if topic in theirs}


def _told(robot: Robot, part: IncludedPart) -> dict[str, str]:
    ends = [end for name in sorted(part.components & robot.components.keys()) for end in robot.components[name].ends]
    told = [end for end in ends if answers(end) or (isinstance(end.port, Out) and end.port.qos is not Qos.COMMAND)]
    return {end.topic: end.port.topic for end in told if not end.port.topic.startswith("/")}
