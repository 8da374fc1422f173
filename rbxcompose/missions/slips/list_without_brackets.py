"""A list of items written without its brackets: `in: dock, kitchen`."""

from __future__ import annotations

from rbxcompose.manifest.brackets import bracketed, without_brackets
from rbxcompose.manifest.tree import ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair


@slip(Takes.ITEMS)
def list_without_brackets(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise several items; a single one may be the name of a datum."""
    found = without_brackets(node)
    if len(found) < 2 or not isinstance(node, ScalarNode):
        return None
    help_text, fix = bracketed(node)
    items = tuple(ScalarNode(text, inner_span(node, start, start + len(text))) for text, start in found)
    finding = codes.WRONG_SHAPE.at(node.span, f"'{place.key.text}' needs a list", help=help_text, fix=fix)
    return Repair(SequenceNode(items, node.span), (finding,))
