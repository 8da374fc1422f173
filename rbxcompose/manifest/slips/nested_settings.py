"""Settings under a key of their own: `ros__parameters:` between a component and its settings."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.slips import Repair

_ALWAYS = "ros__parameters"
_OFTEN = ("config", "configuration", "options", "parameters", "params", "settings")


@value_slip("extra_forbidden")
def nested_settings(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the key of ROS, and other words if keys that are known here stand below them."""
    key = str(place.path[-1])
    inner = node.get(key) if isinstance(node, MappingNode) else None
    if not isinstance(node, MappingNode) or not isinstance(inner, MappingNode):
        return None
    if key != _ALWAYS and not (key in _OFTEN and any(name in place.keys for name in inner.entries)):
        return None
    left = {name: entry for name, entry in node.entries.items() if name != key}
    help_text = f"remove '{key}:' and move what is below it to the left, into its column"
    finding = replace(place.finding, help=help_text)
    return Repair(MappingNode({**inner.entries, **left}, node.span), (finding,))
