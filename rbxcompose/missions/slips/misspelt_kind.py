"""A misspelt word of a kind beside an option of kinds: `repeet: 3` with `do`."""

from __future__ import annotations

from rbxcompose.findings import nearest
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
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
        if meant := nearest(word, words.kinds):
            key = node.entries[word].key
            finding = codes.UNKNOWN_KEY.misspelt(key.span, f"unknown step '{word}'", word, words.kinds)
            right = Entry(ScalarNode(meant[0], key.span), node.entries[word].value)
            entries = dict((meant[0], right) if one[0] == word else one for one in node.entries.items())
            return Repair(MappingNode(entries, node.span), (finding,))
    return None
