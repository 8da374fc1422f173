"""Bounds that an arm is to keep on its way, and that leave it no place."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.goal_beyond_limits import known_value
from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import MappingNode, SequenceNode, TreeNode
from rbxcompose.missions.analysis.facts import Constants
from rbxcompose.missions.language.asked import WrittenArgument
from rbxcompose.model.arm_goals import written_reaches
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot

_KEEP, _ENDS = "keep", ("lower", "upper")


@check("RBX2375")
def kept_bounds(robot: Robot) -> Iterator[Finding]:
    """The bounds that an arm is to keep on its way are the wrong way round."""
    for verb in ("reach", "move"):
        for goal in written_reaches(robot, verb):
            if _KEEP in goal.arguments:
                for node in _ranges(goal.arguments[_KEEP].value, constants(goal.mission)):
                    yield kept_bounds.at(node.span, "this range goes from more to less", help="exchange its ends")


def _ranges(node: TreeNode, known: Constants) -> Iterator[TreeNode]:
    """Yield the ranges below a node whose ends are known and the wrong way round."""
    if isinstance(node, SequenceNode):
        if _is_reversed(node.items, known):
            yield node
        for item in node.items:
            yield from _ranges(item, known)
    elif isinstance(node, MappingNode):
        ends = [node.entries[one].value for one in _ENDS if one in node.entries]
        if _is_reversed(ends, known):
            yield node
        for entry in node.entries.values():
            yield from _ranges(entry.value, known)


def _is_reversed(ends: list[TreeNode] | tuple[TreeNode, ...], known: Constants) -> bool:
    if len(ends) != len(_ENDS):
        return False
    low, high = (known_value(WrittenArgument("", one, one.span), known) for one in ends)
    return low is not None and high is not None and low > high
