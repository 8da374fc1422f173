"""A list of bare names where each name has something below it: `profiles: [simulated]`."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.printable import plain
from rbxcompose.slips import Repair


@value_slip("dict_type")
def names_without_entries(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words; they count only where an entry may be empty."""
    items = node.items if isinstance(node, SequenceNode) else ()
    names = [one for one in items if isinstance(one, ScalarNode) and isinstance(plain_value(one), str)]
    if not names or len(names) != len(items):
        return None
    entries = {one.text: Entry(one, MappingNode({}, one.span)) for one in names}
    first = plain(names[0].text, 60)
    help_text = f"each name needs a line of its own with what belongs to it below: '{first}:' instead of '[{first}]'"
    return Repair(MappingNode(entries, node.span), (replace(place.finding, help=help_text),))
