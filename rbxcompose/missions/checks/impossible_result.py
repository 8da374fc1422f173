"""Results that a branch cannot have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import walk
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.missions.program.branches import compared_with_word
from rbxcompose.missions.program.outcomes import FAILS, SUCCEEDS, Outcomes
from rbxcompose.rules import OWN


@mission_check("RBX4135", Severity.WARNING, closed=(OWN,))
def impossible_result(mission: Examined) -> Iterator[Finding]:
    """A branch is compared with a result that it cannot have."""
    for node in mission.program.nodes:
        ends = mission.ending.of_branches(node)
        for outcome in node.step.branches.outcomes if node.step.branches else ():
            for tree, _ in walk(outcome.condition.tree) if outcome.condition else ():
                branch, word = compared_with_word(tree) or ("", None)
                result = word.name if word else ""
                if outcome.asked and _is_impossible(ends.get(branch), result):
                    yield impossible_result.at(
                        inner_span(outcome.asked.scalar, tree.start, tree.end),
                        f"the branch '{branch}' never ends with '{result}'",
                        help=f"it ends with {' or '.join(ends[branch].words) or 'nothing: it runs for ever'}",
                    )


def _is_impossible(ends: Outcomes | None, result: str) -> bool:
    return ends is not None and result in (SUCCEEDS, FAILS) and not ends.counting_as(result)
