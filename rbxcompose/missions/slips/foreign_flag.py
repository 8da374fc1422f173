"""`yes`, `no`, `on` and `off`, which are texts here."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.findings import replacement
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

FLAGS: Mapping[str, str] = {"no": "false", "off": "false", "on": "true", "yes": "true"}


@slip(Takes.FLAG)
def foreign_flag(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise other words for true and false."""
    meant = FLAGS.get(node.text.lower(), "") if isinstance(node, ScalarNode) and node.filled is None else ""
    if not meant or not isinstance(node, ScalarNode):
        return None
    message, fix = f"'{place.key.text}' must be true or false", replacement(node.span, node.text, meant)
    finding = codes.NOT_A_CHOICE.at(node.span, message, help=f"write '{meant}'", fix=fix)
    return Repair(ScalarNode(meant, node.span), (finding,))
