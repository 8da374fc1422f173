"""Inputs and data that a mission never reads."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.rules import OWN


@check("RBX4129", Severity.WARNING, closed=(OWN,))
def unread_name(robot: Robot) -> Iterator[Finding]:
    """A mission never reads one of its inputs or data."""
    seen = set()
    for mission in robot.missions.values():
        program = mission.program
        if program.file in seen:
            continue  # shares its file with another mission
        seen.add(program.file)
        read = program.reads
        for node in program.nodes:
            kept = node.saved
            if kept and kept.text not in read:
                message = f"the mission '{program.name}' never reads what it keeps as '{kept.text}'"
                help_text = f"remove 'save', or write '${kept.text}' where it belongs"
                yield unread_name.at(kept.span, message, help=help_text)
        for what, names in (("input", program.inputs), ("datum", program.data)):
            for name in names:
                if name not in read:
                    yield unread_name.at(
                        names[name].span,
                        f"the mission '{program.name}' never reads its {what} '{name}'",
                        help=f"remove it, or write '${name}' where it belongs",
                    )
