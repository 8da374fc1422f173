"""`battery/battery_level` where a component and its port are joined by a dot."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.findings import replacement
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.slips import Repair


@value_slip("string_pattern_mismatch")
def slash_for_a_dot(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a path of two names."""
    if not isinstance(node, ScalarNode) or node.text.strip("/").count("/") != 1:
        return None
    meant = node.text.strip("/").replace("/", ".")
    fix = replacement(node.span, node.text, meant)
    finding = replace(place.finding, help=f"a component and its port are joined by a dot: write '{meant}'", fix=fix)
    return Repair(replace(node, text=meant), (finding,))
