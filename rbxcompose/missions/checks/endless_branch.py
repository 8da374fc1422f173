"""Parallels that wait for a branch that never ends."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Expression, Number
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.branches import ALL, Branches
from rbxcompose.missions.program.outcomes import SUCCEEDS
from rbxcompose.missions.program.program import MissionNode, Program
from rbxcompose.rules import OWN


@mission_check("RBX4138", Severity.WARNING, closed=(OWN,))
def endless_branch(mission: Examined) -> Iterator[Finding]:
    """A parallel waits for a branch that never succeeds."""
    program, ending = mission.program, mission.ending
    for node in program.nodes:
        branches = node.step.branches
        if branches is None or branches.ends_with:
            continue
        endless = [child for child in node.children if not ending.of(child).counting_as(SUCCEEDS)]
        others = [child for child in node.children if child not in endless]
        endless = [child for child in endless if not _ends_the_mission(program, child)]
        if endless and others and _most_wanted(node, branches) > len(others):
            yield endless_branch.at(
                program.nodes[endless[0]].span,
                "this branch never succeeds, and the parallel waits for it",
                help="write 'ends_with' and the name of the branch that decides, or 'succeed_when: any'",
                related=[Related(program.nodes[others[0]].span, "beside this one")],
            )


def _ends_the_mission(program: Program, branch: int) -> bool:
    """Return whether a branch may end the mission, so that nothing waits for the branch."""
    return any(node.step.ends_mission for node in program.below(branch))


def _most_wanted(node: MissionNode, branches: Branches) -> float:
    """Return how many branches must succeed; 0 if the text does not say."""
    if branches.succeed_when == ALL:
        return len(node.children)
    tree = branches.succeed_when.tree if isinstance(branches.succeed_when, Expression) else None
    return tree.value if isinstance(tree, Number) else 0
