"""`then` behind the condition of an `if`, and `while` or `until` behind `repeat`."""

from __future__ import annotations

import re
from dataclasses import replace

from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, told
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.unknown_settings import unknown_settings
from rbxcompose.printable import plain
from rbxcompose.slips import Repair

_THEN, _ELSE = re.compile(r"\bthen\b:?+"), re.compile(r"\belse\b:?+")
_LOOP = re.compile(r"(?P<word>while|until)\b:?+\s*+(?P<condition>.++)", re.DOTALL)
_LONGEST = 60  # characters of what was written, in the help


@slip(Takes.STEP, before=(unknown_settings,))
def in_the_line_of_if(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise `if: CONDITION then STEP` and `repeat: while CONDITION`."""
    if not isinstance(node, MappingNode):
        return None
    entry = node.entries.get("if")
    if entry and "then" not in node and isinstance(value := entry.value, ScalarNode):
        found = _THEN.search(value.text) if value.plain and not {*value.text} & {*"'\""} else None
        return _then(node, value, found) if found else None
    entry = node.entries.get("repeat")
    if entry and isinstance(value := entry.value, ScalarNode):
        found = _LOOP.fullmatch(value.text) if value.plain else None
        return _loop(node, value, found) if found else None
    return None


def _then(node: MappingNode, value: ScalarNode, found: re.Match[str]) -> Repair[TreeNode]:
    """Return the step with `then`, whose own text needs no further finding."""
    written = value.text[: found.start()].rstrip()
    word = inner_span(value, found.start(), len(value.text))
    first, *others = _ELSE.split(value.text[found.end() :], maxsplit=1)
    step = plain(first.strip() or "STEP", _LONGEST)
    other = f", and 'else: {plain(others[0].strip(), _LONGEST)}' below that" if others else ""
    message = "'then' needs a line of its own"
    finding = codes.WRONG_SHAPE.at(value.span, message, help=f"write 'then: {_as_step(step)}' below 'if'{other}")
    condition = replace(value, text=written, span=inner_span(value, 0, len(written)))
    added = {"then": Entry(ScalarNode("then", word), MappingNode({"": Entry(told(word), told(word))}, word))}
    return Repair(_with(node, "if", condition, added), (finding,))


def _loop(node: MappingNode, value: ScalarNode, found: re.Match[str]) -> Repair[TreeNode]:
    """Return the loop with its condition in a key of its own."""
    condition = plain(found["condition"], _LONGEST)
    until = f"not ({condition})" if found["word"] == "while" else condition
    message = f"'repeat' takes a number or 'forever', not '{found['word']}'"
    help_text = f"write 'repeat: forever', and below it 'until: {until}'"
    finding = codes.WRONG_SHAPE.at(value.span, message, help=help_text)
    span = inner_span(value, found.start("condition"), len(value.text))
    added = {"until": Entry(ScalarNode("until", span), ScalarNode(found["condition"], span))}
    return Repair(_with(node, "repeat", replace(value, text="forever"), added), (finding,))


def _with(node: MappingNode, key: str, value: ScalarNode, added: dict[str, Entry]) -> MappingNode:
    """Return a step with another value for a key, and with those of `added` that it does not have."""
    entries = {**added, **node.entries, key: Entry(node.entries[key].key, value)}
    return MappingNode(entries, node.span)


def _as_step(written: str) -> str:
    """Return a step as it is written: `go_to dock` is `{go_to: dock}`."""
    word, _, argument = written.partition(" ")
    return f"{{{word.rstrip(':')}: {argument}}}" if argument else written
