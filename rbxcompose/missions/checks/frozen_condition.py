"""Conditions that are waited for and that nothing changes."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.types import FLAG
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import written
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4170", Severity.WARNING, closed=())
def frozen_condition(mission: Examined) -> Iterator[Finding]:
    """A condition is waited for that nothing changes."""
    program = mission.program
    fixed = program.data.keys() - written(program)
    for node in program.nodes if fixed else ():
        for asked in node.asked[: node.own]:
            names = {name.name for name in asked.expression.names}
            if asked.is_watched and asked.wanted == FLAG and names and names <= fixed:
                name = sorted(names)[0]
                yield frozen_condition.at(
                    asked.scalar.span,
                    f"no step of this mission sets '${name}', so this never changes",
                    help=f"write 'set: {{{name}: ...}}' where it changes",
                    related=[Related(program.data[name].span, "its only value")],
                )
