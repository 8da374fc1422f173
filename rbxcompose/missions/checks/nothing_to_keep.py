"""Saved results of nodes that have none."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4136")
def nothing_to_keep(mission: Examined) -> Iterator[Finding]:
    """A node has no result to keep."""
    for node in mission.program.nodes:
        if node.saved and not node.step.has_result:
            message = f"'{node.step.word}' has no result to keep"
            yield nothing_to_keep.at(node.saved.span, message, help="skills, 'call', 'use' and 'for' have one")
