"""More branches than there are."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Expression, Number
from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4153")
def too_many(mission: Examined) -> Iterator[Finding]:
    """A parallel counts more branches than it has."""
    for node in mission.program.nodes:
        branches = node.step.branches
        if branches is None:
            continue
        for key, wanted in (("succeed_when", branches.succeed_when), ("fail_when", branches.fail_when)):
            tree = wanted.tree if isinstance(wanted, Expression) else None
            if isinstance(tree, Number) and tree.value > len(node.children) > 0:
                span = next(asked.scalar.span for asked in node.asked if asked.expression is wanted)
                message = f"'{key}' counts {tree.value:.0f} branches; there are {len(node.children)}"
                yield too_many.at(span, message)
