"""A controller that waits while somebody commands it."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.ports import In, ServesAction
from rbxcompose.sections.controllers import controllers


@check("RBX2284", Severity.WARNING, closed=(WIRING, NAMES))
def waiting_controller(robot: Robot) -> Iterator[Finding]:
    """A controller is commanded, but waits."""
    known = robot.manifest.contents.of(controllers)
    led = {joint for one in known.values() if one.start == "active" for joint in one.claimed}
    for name, one in known.items():
        if one.start == "active" or led & {*one.claimed}:
            continue
        if who := next((sender for end in _ends(robot, name) for sender in _senders(robot, end)), None):
            yield waiting_controller.at(
                robot.value("controllers", name, "start"),
                f"'{who}' commands the controller '{name}', which is not active from the start",
                help="remove 'start: inactive'",
                related=[Related(robot.entry_span(who), "it commands")] if who in robot.components else [],
            )


def _ends(robot: Robot, name: str) -> Iterator[PortEnd]:
    """Yield the ends of a controller."""
    for component in robot.components.values():
        yield from (end for end in component.ends if component.places.get(end.name, ())[:2] == ("controllers", name))


def _senders(robot: Robot, end: PortEnd) -> Iterator[str]:
    """Yield who commands at an end: components, and missions."""
    if isinstance(end.port, In):
        yield from (writer.instance for writer in robot.writers.get(end.topic, ()))
    if isinstance(end.port, ServesAction):
        skills = {skill for skill, source in robot.skills.items() if source.topic == end.topic}
        for name, mission in robot.missions.items():
            if any(node.skill in skills for node in mission.program.nodes):
                yield name
