"""A condition can never hold."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import Expression, Junction
from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.bounds import truth
from rbxcompose.model.blame import blamed, decided
from rbxcompose.model.robot import Robot
from rbxcompose.rules import OWN

_LEVEL = "compare with a level that can be reached"


@check("RBX4122", closed=(OWN,))
def never_holds(robot: Robot) -> Iterator[Finding]:
    """A condition can never hold."""
    for mission in robot.missions.values():
        for asked, holds in decided(robot, mission):
            if holds is False:
                span, related = blamed(robot, mission, asked)
                yield never_holds.at(
                    span,
                    f"the condition '{asked.expression.text}' can never hold",
                    help=_cure(asked.expression),
                    related=related,
                )


def _cure(expression: Expression) -> str:
    tree = expression.tree
    is_contrary = isinstance(tree, Junction) and all(truth(one, {}) is None for one in tree.operands)
    return "its parts contradict each other: join them by 'or', or change a limit" if is_contrary else _LEVEL
