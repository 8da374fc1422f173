"""Numbers that make a step pointless."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Expression, Minus, Number
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.facts import place_in_text


@mission_check("RBX4128", Severity.WARNING, closed=())
def pointless_number(mission: Examined) -> Iterator[Finding]:
    """A number of rounds or attempts, or a duration, leaves nothing to be done."""
    for node in mission.program.nodes:
        modifiers = (one for modifier in node.modifiers.values() for one in modifier.numbers)
        for what, expression, least in (*node.step.numbers, *modifiers):
            value = _written(expression)
            if value is not None and value < least:
                yield pointless_number.at(
                    place_in_text(node, expression),
                    f"{what} must be above zero to have an effect",
                    help="write a larger number, or leave it out",
                )


def _written(expression: Expression | None) -> float | None:
    """Return a literal number; one that has a name may have been chosen on purpose."""
    match expression.tree if expression and expression.text else None:
        case Number(value=value):
            return value
        case Minus(operand=Number(value=value)):
            return -value
    return None
