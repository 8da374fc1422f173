"""A misspelt word of a kind beside an option of kinds: `repeet: 3` with `do`."""

from __future__ import annotations

from rbxcompose.findings import DID_YOU_MEAN, nearest, replacement
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.foreign_steps import FOREIGN
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.tight_dashes import tight_dashes
from rbxcompose.slips import Repair


@slip(Takes.STEP, after=(tight_dashes,))
def misspelt_kind(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a step of no kind that has an option of some kind and a word similar to that of a kind."""
    words = place.words
    if not isinstance(node, MappingNode) or words.kind_of(node):
        return None
    own = words.own(node)
    others = [key for key in own if not words.is_option(key)]
    for word in others if len(others) < len(own) else ():
        ours = FOREIGN.get(word.casefold(), "")
        if meant := [ours] if ours in words.kinds else nearest(word, words.kinds):
            key, message = node.entries[word].key, f"unknown step '{word}'"
            finding = codes.UNKNOWN_KEY.misspelt(key.span, message, word, words.kinds)
            if ours:
                fix = replacement(key.span, word, ours, is_safe=False)
                finding = codes.UNKNOWN_KEY.at(key.span, message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
            right = Entry(ScalarNode(meant[0], key.span), node.entries[word].value)
            entries = dict((meant[0], right) if one[0] == word else one for one in node.entries.items())
            return Repair(MappingNode(entries, node.span), (finding,))
    return None
