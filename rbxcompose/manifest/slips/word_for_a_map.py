"""A word where a map belongs, as if it were the value of the first key: `estop: button`."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.printable import plain
from rbxcompose.slips import Repair


@value_slip("model_type", "model_attributes_type")
def word_for_a_map(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a word; it counts only if the map accepts it there."""
    is_word = isinstance(node, ScalarNode) and isinstance(plain_value(node), str) and node.text[:1].isalpha()
    if not is_word or not isinstance(node, ScalarNode) or not place.keys:
        return None
    first, key = place.keys[0], place.path[-1]
    help_text = f"write '{key}: {{{first}: {plain(node.text, 60)}}}'"
    meant = MappingNode({first: Entry(ScalarNode(first, node.span), node)}, node.span)
    return Repair(meant, (replace(place.finding, help=help_text),))
