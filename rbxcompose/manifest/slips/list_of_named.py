"""A list where entries need names: `inputs:` with a dash before each input."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.named_items import entry_of, help_with_names, name_of
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.slips import Repair


@value_slip("dict_type")
def list_of_named(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a list whose items tell how they are called, by `name` or by the file that they name."""
    if not isinstance(node, SequenceNode) or not node.items or not all(map(name_of, node.items)):
        return None
    entries = {name_of(one): Entry(ScalarNode(name_of(one), one.span), entry_of(one)) for one in node.items}
    return Repair(MappingNode(entries, node.span), (replace(place.finding, help=help_with_names(node)),))
