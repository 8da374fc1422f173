"""Steps below a word that takes a list, written without dashes."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Edit, Fix
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words, told
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

_DASH = "- "


@slip(Takes.STEPS, Takes.BRANCHES)
def missing_dashes(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the value of a `sequence` or another list of steps that is no list."""
    if isinstance(node, SequenceNode) or (isinstance(node, MappingNode) and place.takes is Takes.BRANCHES):
        return None
    key = place.key
    message = f"'{key.text}' needs a list: each of its steps has a dash"
    if isinstance(node, ScalarNode) or not node.entries:
        word = node.text.split()[0] if isinstance(node, ScalarNode) and node.text.strip() else "go_to: dock"
        help_text = f"write each step on a line of its own below '{key.text}:', such as '- {word}'"
        return Repair(told(node.span), (codes.WRONG_SHAPE.at(key.span, message, help=help_text),))
    first = next(iter(node.entries.values()))
    shown = f"- {first.key.text}" + (f": {first.value.text}" if isinstance(first.value, ScalarNode) else ":")
    help_text = f"put a dash before each step: '{shown.removesuffix(': ')}'"
    fix = _dashed(node, place.words)
    finding = codes.WRONG_SHAPE.at(first.key.span, message, label="put a dash here", help=help_text, fix=fix)
    return Repair(SequenceNode(tuple(_steps(node, place.words)), node.span), (finding,))


def _steps(value: MappingNode, words: Words) -> Iterator[MappingNode]:
    """Yield the steps that were meant by the keys of a map; a setting belongs to the step above it."""
    entries: dict[str, Entry] = {}
    for name, entry in value.entries.items():
        if entries and name not in words.modifiers and not words.is_option(name):
            yield MappingNode(entries, next(iter(entries.values())).key.span)
            entries = {}
        entries[name] = entry
    yield MappingNode(entries, next(iter(entries.values())).key.span)


def _dashed(value: MappingNode, words: Words) -> Fix | None:
    """Return the fix that puts a dash before each step, if each is one known word with its value on the same line."""
    entries = list(value.entries.items())
    lines = [entry.key.span.line for _, entry in entries]
    is_plain = all(
        words.is_step(name)
        and name not in words.modifiers
        and not words.is_option(name)
        and entry.key.plain
        and isinstance(entry.value, ScalarNode)
        and entry.value.span.end_line == entry.key.span.line
        for name, entry in entries
    )
    # The map has only one of two equal keys: the line of the other, here the last one, would not get a dash.
    behind = value.span.end_line - lines[-1], value.span.end_column
    is_whole = behind[0] <= 0 or (behind[0] == 1 and behind[1] < entries[0][1].key.span.column)
    if not is_plain or not is_whole or lines != list(range(lines[0], lines[0] + len(lines))):
        return None
    edits = []
    for name, entry in entries:
        span, indent = entry.key.span, " " * (entry.key.span.column - 1)
        before = span._replace(column=1, end_line=span.line, end_column=span.column)
        edits += [Edit(before, indent, indent), Edit(span, name, f"{_DASH}{name}")]
    return Fix(tuple(edits), True, f"'{entries[0][0]}' -> '- {entries[0][0]}'")
