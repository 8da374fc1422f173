"""A component's need that nothing meets."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.model.wires import PortEnd
from rbxcompose.qos import Qos
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Serves, ServesAction
from rbxcompose.sdk.registry import types_with

SERVED_BY = {Calls: Serves, CallsAction: ServesAction, In: Out}


@check("RBX3010", Severity.WARNING, closed=(WIRING, NAMES))
def needed_port(robot: Robot) -> Iterator[Finding]:
    """A component needs something that nothing in the robot provides."""
    given = {(type(end.port), end.topic) for end in robot.ends}
    lost = {end.type_name for ends in robot.writers.values() for end in ends if is_unheard(robot, end)}
    for component in robot.components.values():
        if component.declared(RunsMissions):
            continue  # its values may come from outside, and its skills are those that exist
        needed = [
            end for end in component.ends if type(end.port) in SERVED_BY and not getattr(end.port, "is_open", False)
        ]
        missing = [end for end in needed if (SERVED_BY[type(end.port)], end.topic) not in given]
        missing = [end for end in missing if end.topic not in robot.outside.names]
        # A command without a subscriber is reported at its publisher.
        ends = [end for end in missing if not (_is_command(end) and end.type_name in lost)]
        if ends:
            yield _finding(robot, component, ends)


def is_unheard(robot: Robot, end: PortEnd) -> bool:
    """Return whether this end publishes commands that nothing receives."""
    return isinstance(end.port, Out) and end.port.qos is Qos.COMMAND and end.topic not in robot.readers


def _is_command(end: PortEnd) -> bool:
    return isinstance(end.port, In) and end.port.qos is Qos.COMMAND


def _finding(robot: Robot, component: RobotComponent, ends: list[PortEnd]) -> Finding:
    names = " and ".join(f"'{end.topic}'" for end in ends)
    near = [(end, other) for end in ends for other in robot.ends if _fits(end, other)]
    fix = robot.connection((end, other.topic.strip("/")) for end, other in near)
    return needed_port.at(
        robot.end_span(ends[0]),
        f"'{component.name}' needs {names}, which nothing in the robot provides",
        help=f"connect it: {fix}" if fix else f"add the component that provides it{_such_as(ends)}",
        related=[Related(robot.end_span(other), f"'{other.topic}' is of this type") for _, other in near],
    )


def _such_as(ends: list[PortEnd]) -> str:
    """Return the types of components that could provide all of this, as words that follow; empty without any."""
    found = [types_with(SERVED_BY[type(end.port)], end.topic.rpartition("/")[-1], end.type_name) for end in ends]
    both = [name for name in found[0] if all(name in names for names in found)]
    return f", such as one of the type {' or '.join(map(repr, both))}" if both else ""


def _fits(end: PortEnd, other: PortEnd) -> bool:
    is_another = other.instance != end.instance  # a component that subscribes to itself receives nothing
    return is_another and type(other.port) is SERVED_BY[type(end.port)] and other.type_name == end.type_name
