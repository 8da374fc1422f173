"""A loop of programming languages: `while: $battery > 50 %` with `do` below it."""

from __future__ import annotations

from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.misspelt_kind import misspelt_kind
from rbxcompose.printable import plain
from rbxcompose.slips import Repair

_WORDS = ("while", "until")
_LONGEST = 60  # characters of the condition, in the help


@slip(Takes.STEP, before=(misspelt_kind,))
def while_loop(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the word with what to do beside it, where no step of another kind is."""
    if not isinstance(node, MappingNode) or place.words.kind_of(node) or "do" not in node:
        return None
    word = next((one for one in _WORDS if one in node and one not in place.words.skills), "")
    if not word:
        return None
    entry = node.entries[word]
    text = plain(entry.value.text, _LONGEST) if isinstance(entry.value, ScalarNode) else "CONDITION"
    until = f"not ({text})" if word == "while" else text
    help_text = f"write 'repeat: forever', and below it 'until: {until}', which is asked after each round"
    finding = codes.UNKNOWN_KEY.at(entry.key.span, f"unknown step '{word}'", help=help_text)
    ours = {"repeat": ScalarNode("forever", entry.key.span), "until": entry.value}
    made = {name: Entry(ScalarNode(name, entry.key.span), value) for name, value in ours.items()}
    left = {name: one for name, one in node.entries.items() if name != word}
    return Repair(MappingNode({**made, **left}, node.span), (finding,))
