"""Loops over lists that are always empty."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.expressions.tree import ExpressionNode, FieldAccess, Variable
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import replaced
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4183", Severity.WARNING, closed=())
def nothing_to_go_over(mission: Examined) -> Iterator[Finding]:
    """A loop goes over a list that is always empty."""
    program, changed = mission.program, replaced(mission.program)
    for node in program.nodes:
        items = node.step.items
        if isinstance(items, tuple) and not items and not node.asked:
            yield nothing_to_go_over.at(node.span, "its list is empty: nothing in it is ever done", help=_HELP)
        if items is None or isinstance(items, tuple):
            continue
        name, value = _start(items.tree, {key: one.value for key, one in program.data.items() if key not in changed})
        if isinstance(value, list | tuple | Mapping) and not value:
            yield nothing_to_go_over.at(
                node.asked[0].scalar.span,
                f"'{items.text}' is empty, and no step of this mission fills it: nothing in this loop is ever done",
                help=f"write its items under 'data', or 'set: {{{name}: ...}}' in a step before it",
                related=[Related(program.data[name].span, "its only value")],
            )


_HELP = "write its items after 'in', such as 'in: [corner_1, corner_2]'"


def _start(tree: ExpressionNode, data: Mapping[str, Value]) -> tuple[str, Value]:
    """Return the datum that an expression reads and what the part of it is at the start; None if it is not known."""
    match tree:
        case Variable(name=name):
            return name, data.get(name)
        case FieldAccess(of=of, name=entry):
            name, whole = _start(of, data)
            return name, whole.get(entry) if isinstance(whole, Mapping) else None
    return "", None
