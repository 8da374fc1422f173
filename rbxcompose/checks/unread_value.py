"""A value that no mission reads."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.rules import MISSIONS


@check("RBX3012", Severity.WARNING, closed=(MISSIONS,))
def unread_value(robot: Robot) -> Iterator[Finding]:
    """A value that no mission reads."""
    read = frozenset[str]().union(*(mission.program.reads for mission in robot.missions.values()))
    given = frozenset[str]().union(*(part.values for part in robot.manifest.parts.values()))
    for name in robot.manifest.values if robot.missions else ():
        if name not in read | given:
            yield unread_value.at(
                robot.key("values", name),
                f"no mission reads the value '{name}'",
                help=f"remove it, or read it in a mission as '${name}'",
            )
