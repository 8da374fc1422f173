"""Targets that interrupts restart."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4145", is_fixable=True)
def unknown_target(mission: Examined) -> Iterator[Finding]:
    """An interrupt restarts something that does not exist."""
    known = {name for node in mission.program.nodes for name in (node.name, node.item) if name}
    for interrupt in mission.program.interrupts:
        named = interrupt.restarts
        if named and not interrupt.targets and not mission.program.is_open:
            message = f"nothing in the mission is named '{named.text}'"
            yield unknown_target.misspelt(named.span, message, named.text, known, "names of the mission")
