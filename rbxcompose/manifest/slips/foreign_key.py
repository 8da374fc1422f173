"""A key that other tools have for the same: `depends_on` of Docker Compose, `remappings` of ROS launch files."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.findings import DID_YOU_MEAN, replacement
from rbxcompose.manifest.foreign_words import FOREIGN
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import Entry, MappingNode, TreeNode
from rbxcompose.slips import Repair


@value_slip("extra_forbidden")
def foreign_key(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it where our key for it is known and not written."""
    key, ours = str(place.path[-1]), FOREIGN.get(str(place.path[-1]), "")
    if ours not in place.keys or not isinstance(node, MappingNode) or ours in node:
        return None
    entry = node.entries[key]
    fix = replacement(entry.key.span, key, ours, is_safe=False)  # its value may have another form
    entries = {ours if name == key else name: one for name, one in node.entries.items()}
    entries[ours] = Entry(replace(entry.key, text=ours), entry.value)
    finding = replace(place.finding, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
    return Repair(MappingNode(entries, node.span), (finding,))
