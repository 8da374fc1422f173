"""Loops and conditions in the words or the form of other languages."""

import re
from dataclasses import replace

from rbxcompose.base.findings import Finding
from rbxcompose.base.printable import plain
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.asked import inner_span
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, placeholder
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.settings import foreign_keys, unknown_settings
from rbxcompose.missions.slips.steps import misspelt_kind

_WORDS = ("while", "until")
_LONGEST = 60  # characters of the condition, in the help


@slip(Takes.STEP, before=(misspelt_kind,))
def while_loop(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the word with what to do beside it, where no step of another kind is."""
    if not isinstance(node, MappingNode) or place.words.kind_of(node) or "do" not in node:
        return None
    word = next((candidate for candidate in _WORDS if candidate in node and candidate not in place.words.skills), "")
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


_THEN, _ELSE = re.compile(r"\bthen\b:?+"), re.compile(r"\belse\b:?+")
_LOOP = re.compile(r"(?P<word>while|until)\b:?+\s*+(?P<condition>.++)", re.DOTALL)


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
    added = {
        "then": Entry(ScalarNode("then", word), MappingNode({"": Entry(placeholder(word), placeholder(word))}, word))
    }
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


_COUNTS = ("times", "count", "rounds", "n")
_BODIES = ("do", "steps", "sequence", "body")
_IN = re.compile(r"(?P<item>[a-z]\w*)\s+in\s+(?P<list>\S.*)", re.DOTALL)


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
    count = next((candidate for candidate in _COUNTS if candidate in below), "")
    body = next((candidate for candidate in _BODIES if candidate in below), "")
    if not body or "do" in node:
        return None
    rounds = below.entries[count].value if count else ScalarNode("forever", key.span)
    shown = plain(rounds.text, _LONGEST) if isinstance(rounds, ScalarNode) else "..."
    help_text = (
        f"write 'repeat: {shown}', and the other keys below it, in the column of 'repeat', with 'do' for the steps"
    )
    finding = codes.WRONG_SHAPE.at(key.span, "the settings of 'repeat' are below it", help=help_text)
    others = {name: entry for name, entry in below.entries.items() if name not in (count, body)}
    made = {"repeat": Entry(key, rounds), "do": replace(below.entries[body], key=ScalarNode("do", key.span))}
    return Repair(replace(node, entries={**made, **others, **_but(node, "repeat")}), (finding,))


def _split(node: MappingNode, value: ScalarNode, found: re.Match[str]) -> Repair[TreeNode]:
    """Return the loop with its list in a key of its own, which needs no further finding."""
    item, items = found["item"], plain(found["list"], _LONGEST)
    help_text = f"write 'for: {item}', and below it 'in: {items}'"
    finding: Finding = codes.WRONG_SHAPE.at(value.span, "'in' needs a line of its own", help=help_text)
    span = inner_span(value, found.start("list"), len(value.text))
    words = [part.strip() for part in found["list"].strip("[] ").split(",")]
    listed = SequenceNode(tuple(ScalarNode(word, span) for word in words), span)
    made = {
        "for": Entry(node.entries["for"].key, replace(value, text=item)),
        "in": Entry(ScalarNode("in", span), listed),
    }
    return Repair(replace(node, entries={**made, **_but(node, "for")}), (finding,))


def _but(node: MappingNode, word: str) -> dict[str, Entry]:
    return {name: entry for name, entry in node.entries.items() if name != word}
