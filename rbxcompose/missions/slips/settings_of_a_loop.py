"""A loop in one piece: `repeat: {times: 3, do: ...}`, and `for: place in [door, window]`."""

from __future__ import annotations

import re
from dataclasses import replace

from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.foreign_keys import foreign_keys
from rbxcompose.missions.slips.misspelt_kind import misspelt_kind
from rbxcompose.printable import plain
from rbxcompose.slips import Repair

_COUNTS = ("times", "count", "rounds", "n")
_BODIES = ("do", "steps", "sequence", "body")
_IN = re.compile(r"(?P<item>[a-z]\w*)\s+in\s+(?P<list>\S.*)", re.DOTALL)
_LONGEST = 60  # characters of what was written, in the help


@slip(Takes.STEP, after=(misspelt_kind,), before=(foreign_keys,))
def settings_of_a_loop(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the settings of a loop below its word, or behind it."""
    if not isinstance(node, MappingNode) or (kind := place.words.kind_of(node)) not in ("repeat", "for"):
        return None
    value = node.entries[kind].value
    if kind == "repeat" and isinstance(value, MappingNode):
        return _lifted(node, value)
    found = _IN.fullmatch(value.text) if isinstance(value, ScalarNode) and value.plain and kind == "for" else None
    return _split(node, value, found) if found and isinstance(value, ScalarNode) and "in" not in node else None


def _lifted(node: MappingNode, below: MappingNode) -> Repair[TreeNode] | None:
    """Return the loop with its settings beside its word."""
    key = node.entries["repeat"].key
    count = next((one for one in _COUNTS if one in below), "")
    body = next((one for one in _BODIES if one in below), "")
    if not body or "do" in node:
        return None
    rounds = below.entries[count].value if count else ScalarNode("forever", key.span)
    shown = plain(rounds.text, _LONGEST) if isinstance(rounds, ScalarNode) else "..."
    help_text = (
        f"write 'repeat: {shown}', and the other keys below it, in the column of 'repeat', with 'do' for the steps"
    )
    finding = codes.WRONG_SHAPE.at(key.span, "the settings of 'repeat' are below it", help=help_text)
    others = {name: one for name, one in below.entries.items() if name not in (count, body)}
    made = {"repeat": Entry(key, rounds), "do": replace(below.entries[body], key=ScalarNode("do", key.span))}
    return Repair(replace(node, entries={**made, **others, **_but(node, "repeat")}), (finding,))


def _split(node: MappingNode, value: ScalarNode, found: re.Match[str]) -> Repair[TreeNode]:
    """Return the loop with its list in a key of its own, which needs no further finding."""
    item, items = found["item"], plain(found["list"], _LONGEST)
    help_text = f"write 'for: {item}', and below it 'in: {items}'"
    finding: Finding = codes.WRONG_SHAPE.at(value.span, "'in' needs a line of its own", help=help_text)
    span = inner_span(value, found.start("list"), len(value.text))
    words = [one.strip() for one in found["list"].strip("[] ").split(",")]
    listed = SequenceNode(tuple(ScalarNode(one, span) for one in words), span)
    made = {
        "for": Entry(node.entries["for"].key, replace(value, text=item)),
        "in": Entry(ScalarNode("in", span), listed),
    }
    return Repair(replace(node, entries={**made, **_but(node, "for")}), (finding,))


def _but(node: MappingNode, word: str) -> dict[str, Entry]:
    return {name: one for name, one in node.entries.items() if name != word}
