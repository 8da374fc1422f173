"""Two conditions of a step that never hold together."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Junction, Not
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.bounds import truth
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.language.asked import Asked
from rbxcompose.missions.program.answers import NodeFlow
from rbxcompose.missions.program.program import MissionNode, Program

_ASKED_FIRST = ("only_if", "as_long_as")


@mission_check("RBX4169", Severity.WARNING)
def contrary_conditions(mission: Examined) -> Iterator[Finding]:
    """A step has two conditions that never hold together."""
    program = mission.program
    for node in program.nodes:
        only, skip = _condition(node, "only_if"), _condition(node, "skip_if")
        if only and skip and not _go_together(only, skip, is_second=False):
            yield _finding(skip.scalar, only.scalar, "'skip_if' holds whenever 'only_if' does: this step never runs")
    for interrupt in program.interrupts:
        for node in _first_steps(program, interrupt.root):
            for key in _ASKED_FIRST:
                asked, when = _condition(node, key), interrupt.when
                if asked and not _go_together(when, asked, is_second=True):
                    message = f"'{key}' does not hold when '{interrupt.name}' begins, so this step does nothing"
                    yield _finding(asked.scalar, when.scalar, message)


def _finding(at: ScalarNode, other: ScalarNode, message: str) -> Finding:
    return contrary_conditions.at(at.span, message, help="remove one", related=[Related(other.span, "the other one")])


def _condition(node: MissionNode, key: str) -> Asked | None:
    wanted = node.modifiers[key].value if key in node.modifiers else None
    found = [one for one in node.asked[node.own :] if one.expression is wanted and wanted is not None]
    return found[list(node.modifiers).index(key) > 0 and -1] if found else None  # of equal ones, the first or the last


def _go_together(first: Asked, second: Asked, *, is_second: bool) -> bool:
    """Return whether the first may hold while the second does, or does not."""
    one, other = first.expression.tree, second.expression.tree
    if truth(other, {}) is not None:
        return True  # it is decided by itself, as when somebody tries something out
    both = Junction(one.start, one.end, "and", (one, other if is_second else Not(other.start, other.end, other)))
    return truth(both, {}) is not False and (is_second or first.expression.text != second.expression.text)


def _first_steps(program: Program, number: int | None) -> Iterator[MissionNode]:
    """Yield a node and those inside that begin with it, unless another one may begin first."""
    while number is not None:
        node = program.nodes[number]
        yield node
        number = node.children[0] if node.step.flow is NodeFlow.IN_TURN and node.children else None
