"""Results that are kept in data of another type."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.types import UNKNOWN, accepts, map_of
from rbxcompose.findings import Finding, Related
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4162")
def saved_over_datum(mission: Examined) -> Iterator[Finding]:
    """A result is kept in a datum of another type."""
    data = mission.program.data
    for node in mission.program.nodes:
        datum = data.get(node.saved.text) if node.saved and node.step.has_result else None
        if node.saved and datum and not accepts(datum.type, map_of(UNKNOWN)):
            name = node.saved.text
            yield saved_over_datum.at(
                node.saved.span,
                f"'{name}' is {datum.type.phrase}, but the result of '{node.step.word}' is a map",
                help=f"write '{name}: {{}}' under 'data', and read an entry of it as '${name}.NAME'; or save it under "
                "another name",
                related=[Related(datum.span, "the datum")],
            )
