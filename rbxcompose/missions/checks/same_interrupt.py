"""Two interrupts with one condition."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4171", Severity.WARNING, closed=())
def same_interrupt(mission: Examined) -> Iterator[Finding]:
    """Two interrupts have the same condition."""
    first: dict[str, int] = {}
    interrupts = mission.program.interrupts
    for index, one in enumerate(interrupts):
        other = interrupts[first.setdefault(one.when.expression.text, index)]
        if other is not one:
            yield same_interrupt.at(
                one.when.scalar.span,
                f"'{one.name}' has the condition of '{other.name}'",
                help="change the condition, or put both reactions into one",
                related=[Related(other.when.scalar.span, "the first one")],
            )
