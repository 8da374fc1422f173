"""A list item that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import Expression, ExpressionError, FunctionCall, Index, Number, Variable, walk
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.spans import expression_of, inner_span
from rbxcompose.missions.program.program import Program
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot
from rbxcompose.rules import MISSIONS


@check("RBX4132", Severity.WARNING, closed=(MISSIONS,))
def beyond_list(robot: Robot) -> Iterator[Finding]:
    """A list item that does not exist."""
    for mission in robot.missions.values():
        known = constants(mission)
        for scalar, expression in _expressions(mission.program):
            if any(isinstance(tree, FunctionCall) and tree.function == "count" for tree, _ in walk(expression.tree)):
                continue  # the expression checks how long the list is before it takes the item
            for tree, _ in walk(expression.tree):
                match tree:
                    case Index(of=Variable(name=name), index=Number(value=index)):
                        items, datum = known.get(name), mission.program.data.get(name)
                        if datum and isinstance(items, list | tuple) and index >= len(items):
                            yield beyond_list.at(
                                inner_span(scalar, tree.start, tree.end),
                                f"'${name}' has no item {index:.0f}: "
                                + (f"its last is {len(items) - 1}" if items else "it is empty"),
                                help="items are counted from 0",
                                related=[Related(datum.span, "the list")],
                            )


def _expressions(program: Program) -> Iterator[tuple[ScalarNode, Expression]]:
    """Yield all expressions of a mission, the arguments of its skills included."""
    yield from ((asked.scalar, asked.expression) for _, asked in program.asked())
    for node in program.nodes:
        for argument in node.step.arguments:
            if isinstance(argument.value, ScalarNode):
                try:
                    yield argument.value, expression_of(argument.value)
                except ExpressionError:
                    continue  # reported where missions are read
