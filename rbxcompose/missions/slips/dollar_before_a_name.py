"""`$` before the name of a loop's item, where the name is defined."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.findings import replacement
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.language.names import NAME, no_name
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair


@slip(Takes.ITEM_NAME)
def dollar_before_a_name(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a name written as in an expression that uses it."""
    bare = node.text[1:] if isinstance(node, ScalarNode) and node.text.startswith("$") else ""
    if not NAME.fullmatch(bare) or not isinstance(node, ScalarNode):
        return None
    fix = replacement(node.span, node.text, bare)
    finding = replace(no_name(node), help=f"write '{bare}' without '$'", fix=fix)
    return Repair(replace(node, text=bare), (finding,))
