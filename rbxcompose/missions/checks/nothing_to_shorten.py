"""Lists from which items cannot be removed."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4137")
def nothing_to_shorten(mission: Examined) -> Iterator[Finding]:
    """`remove_done` without a list in the data."""
    for node in mission.program.nodes:
        shortened = node.step.effects.shortened
        items = node.step.items
        is_read = isinstance(items, tuple) or (items is not None and items.text)
        if shortened is not None and shortened not in mission.program.data and is_read and not mission.program.is_open:
            help_text = "write the list under 'data', and its name after 'in'"
            span = node.asked[0].scalar.span if node.asked else node.span
            yield nothing_to_shorten.at(span, "'remove_done' needs an 'in' that names data", help=help_text)
