"""A condition below `next`, which takes only transitions."""

from __future__ import annotations

from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, told
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

_ASKING = ("if", "then", "else", "when", "check", "choose", "cases")


@slip(Takes.NEXT)
def asking_next(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words that begin a condition."""
    asking = (
        [entry.key for word, entry in node.entries.items() if word in _ASKING] if isinstance(node, MappingNode) else []
    )
    if not asking:
        return None
    help_text = (
        "let a 'check' be the last step of this state, and write below 'next' where 'success' and 'failure' lead"
    )
    message = f"'next' takes no conditions: there is no '{asking[0].text}' in it"
    return Repair(told(node.span), (codes.WRONG_SHAPE.at(asking[0].span, message, help=help_text),))
