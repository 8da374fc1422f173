"""One number where a range has two: `position: 90 deg`."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import ScalarNode, SequenceNode, TreeNode
from rbxcompose.printable import plain
from rbxcompose.slips import Repair
from rbxcompose.units import UnitError, parse_quantity


@value_slip("list_type", "tuple_type")
def range_of_one(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a quantity; it counts only where a list of two is accepted, and one alone is not."""
    if not isinstance(node, ScalarNode):
        return None
    text = node.text.strip()
    try:
        parse_quantity(text)
    except UnitError:
        return None
    other = text.removeprefix("-") if text.startswith("-") else f"-{text.removeprefix('+')}"
    least, greatest = (text, other) if text.startswith("-") else (other, text)
    help_text = f"a range has two ends: write '[{plain(least, 40)}, {plain(greatest, 40)}]'"
    items = tuple(ScalarNode(one, node.span) for one in (least, greatest))
    return Repair(SequenceNode(items, node.span), (replace(place.finding, help=help_text, fix=None),))
