"""A list written without its brackets: `match: battery, charger`."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.brackets import bracketed, without_brackets
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import ScalarNode, SequenceNode, TreeNode
from rbxcompose.slips import Repair


@value_slip("list_type", "tuple_type")
def list_without_brackets(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise one or several items where a list is required."""
    found = without_brackets(node)
    if not found or not isinstance(node, ScalarNode):
        return None
    help_text, fix = bracketed(node)
    items = tuple(ScalarNode(text, node.span) for text, _ in found)
    return Repair(SequenceNode(items, node.span), (replace(place.finding, help=help_text, fix=fix),))
