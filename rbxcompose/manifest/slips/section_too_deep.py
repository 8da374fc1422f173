"""A section of the file among the keys of another one: `missions:` in the column of `analyzers:`."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.misplaced import misplaced
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import ROBOT
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.slips.foreign_key import foreign_key
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.slips import Repair


@value_slip("extra_forbidden", after=(foreign_key,))
def section_too_deep(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise its name; an entry with the name of a section is found where the entries are read."""
    key = str(place.path[-1])
    if not isinstance(node, MappingNode) or key not in {one.name for one in sections(ROBOT)}:
        return None
    left = {name: entry for name, entry in node.entries.items() if name != key}
    if len(place.path) == 1:  # a section that this kind of file cannot have
        help_text = f"'{key}' belongs to the file of the robot: move it there"
        return Repair(MappingNode(left, node.span), (replace(place.finding, help=help_text, fix=None),))
    return Repair(MappingNode(left, node.span), (misplaced(node.entries[key].key, str(place.path[0])),))
