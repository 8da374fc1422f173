"""Numbers that make a step pointless."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Expression, Minus, Number
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.checking import mission_check
from rbxcompose.missions.examined import Examined
from rbxcompose.missions.facts import place_in_text
from rbxcompose.missions.kinds.repeat import RepeatOptions
from rbxcompose.missions.modifiers.limits import Tries
from rbxcompose.missions.program import Node


@mission_check("RBX4128", Severity.WARNING)
def pointless_number(mission: Examined) -> Iterator[Finding]:
    """A number of rounds or attempts, or a duration, leaves nothing to be done

    `repeat: 0` does nothing, a timeout of zero fails at once, and durations are never negative.

    Bad:
    ```yaml
    do:
      repeat: 0
      do: recharge
    ```
    Good:
    ```yaml
    do:
      repeat: 2
      do: recharge
    ```
    """
    for node in mission.program.nodes:
        for what, expression, least in _numbers(node):
            value = _written(expression)
            if value is not None and (value < least or (least == 0 and value < 0)):
                yield pointless_number.at(
                    place_in_text(node, expression),
                    f"{what} must be above zero to have a meaning",
                    help="write a larger number, or leave it out",
                )


def _numbers(node: Node) -> Iterator[tuple[str, Expression | None, float]]:
    """Yield what a node counts or waits for, its expression, and the least number that makes sense."""
    options, tries, timeout = node.options, node.modifiers.get("attempts"), node.modifiers.get("timeout")
    if isinstance(options, RepeatOptions):
        yield "'repeat'", options.rounds, 1
        yield "'every'", options.every, 0
    if node.kind == "wait" and isinstance(options, Expression):
        yield "a wait", options, 0
    if isinstance(tries, Tries):
        yield "'attempts'", tries.most, 1
    if isinstance(timeout, Expression):
        yield "a timeout", timeout, TINY


TINY = 1e-6  # [s]


def _written(expression: Expression | None) -> float | None:
    """Return a number that is written out; one that has a name may have been chosen so."""
    match expression.tree if expression else None:
        case Number(value=value):
            return value
        case Minus(operand=Number(value=value)):
            return -value
    return None
