"""A frame beside the coordinates of a place: `dock: {x: 1 m, y: 0 m, frame: odom}`."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.slips import Repair

_FRAMES = ("frame", "frame_id", "header", "in")


@value_slip("extra_forbidden")
def frame_of_place(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it in the section `places`."""
    key = str(place.path[-1])
    if place.path[0] != "places" or key not in _FRAMES or not isinstance(node, MappingNode):
        return None
    help_text = f"places are always in 'map': give 'x' and 'y' there, and remove '{key}'"
    left = {name: entry for name, entry in node.entries.items() if name != key}
    return Repair(MappingNode(left, node.span), (replace(place.finding, help=help_text),))
