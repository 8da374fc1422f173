"""A key of another tool that has no counterpart here: `image` of Docker Compose, `use_sim_time` of ROS."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.foreign_words import CURES
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.slips.section_too_deep import section_too_deep
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.slips import Repair


@value_slip("extra_forbidden", before=(section_too_deep,))
def no_counterpart(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it by its name; a map below the name of a section is that section, indented too far."""
    key = str(place.path[-1])
    cure = CURES.get(key)
    if cure is None or not isinstance(node, MappingNode) or key in place.keys:
        return None
    if key == "profiles" and isinstance(node.entries[key].value, MappingNode):
        return None
    left = {name: entry for name, entry in node.entries.items() if name != key}
    return Repair(MappingNode(left, node.span), (replace(place.finding, help=cure, fix=None),))
