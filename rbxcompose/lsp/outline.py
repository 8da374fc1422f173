"""The outline of a manifest: its sections, what they name, and the steps and states of missions."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Span
from rbxcompose.lsp.project import MISSION, kind_of
from rbxcompose.lsp.quick import quick_tree
from rbxcompose.manifest.header import ManifestHeader
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.language.keys import keys_taking
from rbxcompose.missions.modifiers.registry import modifier_keys
from rbxcompose.missions.program.registry import kinds

DEEPEST = 12  # levels of steps that an editor shows
_DETAIL = 60  # characters of a value
_BODIES = ("do", "machine", "interrupts")


@dataclass(frozen=True, slots=True)
class OutlineEntry:
    """One line of an outline: `sort` is 'section', 'name', 'step', 'state' or 'value'."""

    name: str
    sort: str
    detail: str
    span: Span
    key: Span
    below: tuple[OutlineEntry, ...] = ()


def outline(text: str) -> list[OutlineEntry]:
    """Return the outline of a text; empty while it is no YAML."""
    root = quick_tree(text)
    if not isinstance(root, MappingNode):
        return []
    is_mission = kind_of(text) == MISSION
    sections = ((name, entry) for name, entry in root.entries.items() if name not in ManifestHeader.model_fields)
    return [_section(name, entry, is_mission) for name, entry in sections]


def _section(name: str, entry: Entry, is_mission: bool) -> OutlineEntry:
    if is_mission and name in _BODIES:
        return _made(entry, "section", tuple(_of_body(name, entry.value, 1)))
    return _made(entry, "section", tuple(_named(entry.value)))


def _named(node: TreeNode) -> Iterator[OutlineEntry]:
    for entry in node.entries.values() if isinstance(node, MappingNode) else ():
        below = entry.value.entries if isinstance(entry.value, MappingNode) else {}
        inner = (one for one in below.values() if not isinstance(one.value, ScalarNode))
        yield _made(entry, "name", tuple(_made(one, "value", tuple(_named(one.value))) for one in inner))


def _of_body(key: str, node: TreeNode, level: int) -> Iterator[OutlineEntry]:
    """Yield what stands below a key of a mission: steps, or names with steps."""
    if level > DEEPEST:
        return
    if isinstance(node, SequenceNode) and key in keys_taking(Takes.STEP, Takes.STEPS, Takes.BRANCHES):
        for item in node.items:
            yield from _step(item, level)
    elif isinstance(node, MappingNode) and key in keys_taking(Takes.STATES, Takes.INTERRUPTS):
        for entry in node.entries.values():
            yield _made(entry, "state", tuple(_inside(entry.value, level)))
    elif isinstance(node, MappingNode) and key in keys_taking(Takes.BRANCHES, Takes.CASES):
        for entry in node.entries.values():
            yield _made(entry, "state", tuple(_step(entry.value, level + 1)))
    elif isinstance(node, MappingNode) and key == "machine":
        for name, entry in node.entries.items():
            yield from _of_body(name, entry.value, level)
    elif key in keys_taking(Takes.STEP):
        yield from _step(node, level)


def _step(node: TreeNode, level: int) -> Iterator[OutlineEntry]:
    if isinstance(node, ScalarNode) and node.text:
        yield OutlineEntry(node.text, "step", "", node.span, node.span)
    elif isinstance(node, SequenceNode):
        yield from _of_body("sequence", node, level)
    elif isinstance(node, MappingNode):
        own = [key for key in node.entries if key not in ("name", *modifier_keys())]
        word = next((key for key in own if key in kinds()), own[0] if own else "")
        if word:
            entry = node.entries[word]
            yield OutlineEntry(
                word, "step", _detail(entry.value), _around(node), entry.key.span, tuple(_inside(node, level))
            )


def _inside(node: TreeNode, level: int) -> Iterator[OutlineEntry]:
    if isinstance(node, MappingNode):
        for key, entry in node.entries.items():
            yield from _of_body(key, entry.value, level + 1)
    else:
        yield from _step(node, level + 1)


def _made(entry: Entry, sort: str, below: tuple[OutlineEntry, ...]) -> OutlineEntry:
    key, value = entry.key.span, entry.value.span
    span = Span(key.file, key.line, key.column, *max(_end(key), _end(value)))
    return OutlineEntry(entry.key.text, sort, _detail(entry.value), span, key, below)


def _around(node: MappingNode) -> Span:
    first = next(iter(node.entries.values())).key.span
    return Span(first.file, first.line, first.column, *max(_end(node.span), _end(first)))


def _end(span: Span) -> tuple[int, int]:
    return span.end_line, span.end_column


def _detail(node: TreeNode) -> str:
    if isinstance(node, MappingNode) and isinstance(word := node.get("type"), ScalarNode):
        node = word
    text = " ".join(node.text.split()) if isinstance(node, ScalarNode) else ""
    return text if len(text) <= _DETAIL else f"{text[: _DETAIL - 3]}..."
