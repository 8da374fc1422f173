"""Outputs that are always the same."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import written
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.rules import OWN


@mission_check("RBX4134", Severity.WARNING, closed=(OWN,))
def unwritten_output(mission: Examined) -> Iterator[Finding]:
    """An output that nothing writes."""
    program = mission.program
    constant = program.data.keys() - written(program)
    for name, asked in program.outputs.items():
        read = {one.name for one in asked.expression.names}
        if read and read <= constant:
            first = sorted(read)[0]
            yield unwritten_output.at(
                asked.scalar.span,
                f"the output '{name}' is always the same: nothing sets '{first}'",
                help=f"set '{first}' where its value is known, or keep a result with 'save: {first}'",
                related=[Related(program.data[first].span, "its only value")],
            )
