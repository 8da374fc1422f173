"""Loops that never read their item."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Expression, Variable, Word
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.facts import Constants, constants_of
from rbxcompose.missions.program.program import MissionNode, Program
from rbxcompose.rules import OWN


@mission_check("RBX4187", Severity.WARNING, closed=(OWN,))
def unread_item(mission: Examined) -> Iterator[Finding]:
    """A loop never reads its item."""
    program = mission.program
    known = constants_of(program, {})
    for node in program.nodes:
        if node.step.items is None or node.item in program.reads:
            continue
        items = _words(node, known)
        for scalar in _written(program, node):
            if scalar.text in items:
                yield unread_item.at(
                    scalar.span,
                    f"each round takes '{scalar.text}': nothing in this loop reads '${node.item}'",
                    help=f"write '${node.item}'",
                    related=[Related(node.span, "the loop")],
                )
                break


def _words(node: MissionNode, known: Constants) -> set[str]:
    """Return the items of a loop that are words, as far as the text shows them."""
    items = node.step.items
    if isinstance(items, Expression):
        listed = known.get(items.tree.name) if isinstance(items.tree, Variable) else None
        return {one for one in listed if isinstance(one, str)} if isinstance(listed, list | tuple) else set()
    return {one.tree.name for one in items or () if isinstance(one.tree, Word)}


def _written(program: Program, loop: MissionNode) -> Iterator[ScalarNode]:
    """Yield the values that steps inside of a loop give to skills and missions."""
    for node in program.nodes[loop.number + 1 : loop.end]:
        yield from (one.value for one in node.step.arguments if isinstance(one.value, ScalarNode))
