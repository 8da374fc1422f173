"""A list that was replaced, but was probably meant to be extended."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.idle_overlay import changes
from rbxcompose.composition.history import HistoryStep
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.manifest.tree import ScalarNode, SequenceNode, TreeNode
from rbxcompose.manifest.walk import REPLACE
from rbxcompose.model.robot import Robot


@check("RBX7002", Severity.WARNING, closed=())
def shortened_list(robot: Robot) -> Iterator[Finding]:
    """A profile or an overlay adds to a list and drops its old items."""
    for before, after, path in changes(robot):
        if words := lost(before.node, after.node):
            yield shortened_list.at(
                after.span,
                f"{after.layer} replaces the list '{path}' and drops {', '.join(map(repr, words))}",
                help="write the whole list, or '!replace' before it if you mean it",
                related=[Related(before.span, f"the list in {before.layer}")],
            )


def dropped(robot: Robot) -> set[str]:
    """Return all words that lists lose in this way."""
    return {word for before, after, _ in changes(robot) for word in lost(before.node, after.node)}


def taken_out(robot: Robot) -> dict[str, HistoryStep]:
    """Return all words that lists lose, each with the list that lacks it."""
    found: dict[str, HistoryStep] = {}
    for before, after, _ in changes(robot):
        if isinstance(after.node, SequenceNode):
            new = _words(after.node)
            found |= {word: after for word in _words(before.node) if word not in new}
    return found


def lost(before: TreeNode | None, after: TreeNode | None) -> list[str]:
    """Return the words missing from a new list that also adds some and is not marked `!replace`."""
    if not isinstance(after, SequenceNode) or after.tag == REPLACE:
        return []
    old, new = _words(before), _words(after)
    return [word for word in old if word not in new] if new.keys() - old.keys() else []


def _words(node: TreeNode | None) -> dict[str, None]:
    items = node.items if isinstance(node, SequenceNode) else ()
    return dict.fromkeys(item.text for item in items if isinstance(item, ScalarNode))
