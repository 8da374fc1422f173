"""Commands without a subscriber."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.needed_port import is_unheard
from rbxcompose.findings import Finding, Related, Severity, suggest
from rbxcompose.manifest.tree import at
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.sdk.ports import In
from rbxcompose.sdk.registry import types_with

WAITING = "topics that wait for such commands"
_MOST_SHOWN = 8  # subscribers that are pointed at


@check("RBX3011", Severity.WARNING, closed=(WIRING, NAMES))
def unheard_command(robot: Robot) -> Iterator[Finding]:
    """Commands are published on a topic without a subscriber."""
    waiting: dict[str, list[PortEnd]] = {}  # by the type of their messages
    for one in (one for topic, ends in robot.readers.items() if topic not in robot.writers for one in ends):
        waiting.setdefault(one.type_name, []).append(one)
    for end in robot.ends:
        if is_unheard(robot, end):
            starving = [one for one in waiting.get(end.type_name, ()) if one.instance != end.instance]
            topics = [one.topic.strip("/") for one in starving]
            yield unheard_command.at(
                robot.end_span(end),
                f"nothing subscribes to the commands of '{end.instance}' on '{end.topic}'",
                help=_cure(robot, end, starving) or suggest(end.topic.strip("/"), topics, WAITING) or _such_as(end),
                related=[Related(robot.end_span(one), f"listens to '{one.topic}'") for one in starving[:_MOST_SHOWN]],
            )


def _such_as(end: PortEnd) -> str:
    found = types_with(In, end.topic.rpartition("/")[-1], end.type_name)
    return (
        f"add the component that follows them, such as one of the type {' or '.join(map(repr, found))}" if found else ""
    )


def _cure(robot: Robot, end: PortEnd, starving: list[PortEnd]) -> str:
    """Return what to do if the only one that waits was connected to another topic than its own."""
    bases = [base.end(drives.commands) for base, drives in robot.declared(Drives)]
    elsewhere = [one for one in bases if one and one.type_name == end.type_name and one.topic != end.topic]
    if len(starving or elsewhere) != 1:
        return ""
    [one] = starving or elsewhere
    connect = (*robot.components[one.instance].path, "connect", one.name)
    if at(robot.manifest.root, connect) is None:
        return ""
    topic = end.topic.strip("/")
    cure = f"let '{one.instance}' listen to '{topic}': write '{one.name}: {topic}' below its 'connect', or remove that"
    past = [writer.instance for writer in robot.writers.get(one.topic, ()) if writer.instance != end.instance]
    if end.instance in robot.manifest.muxes and past:
        cure += f"; and let '{end.instance}' have an input with 'from: {past[0]}', which commands past it now"
    return cure
