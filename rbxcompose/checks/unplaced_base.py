"""A base whose place nobody tells, although somebody asks for it."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import Drives, WritesFrame
from rbxcompose.sdk.ports import Looks


@check("RBX2286", Severity.WARNING, closed=(WIRING, NAMES))
def unplaced_base(robot: Robot) -> Iterator[Finding]:
    """Somebody looks up where the robot is, and nobody tells."""
    description, bases = robot.manifest.body, robot.declared(Drives)
    if description is None or not description.body.links or not bases:
        return
    links, root = description.body.links, description.body.root
    placed = {frame.child.value for _, frame in robot.declared(WritesFrame)}
    if root in placed or any(base.declared(WritesFrame) for base, _ in bases):
        return  # a base that moves another frame is told as RBX2019
    base, drives = bases[0]
    for component in robot.components.values():
        for port in (end.port for end in component.ends):
            if isinstance(port, Looks) and port.source in links and port.target not in links:
                yield unplaced_base.at(
                    robot.entry_span(base.name, drives.commands),
                    f"nobody tells where '{port.source}' is in '{port.target}', and '{component.name}' looks it up",
                    help="let the base publish its frame, or add what localises the robot",
                    related=[Related(robot.entry_span(component.name), "it looks it up")],
                )
                return
