"""A manifest's tree, built fast and without any checks, since a person waits for each keystroke."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

import yaml

from rbxcompose.findings import Span
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.manifest.yaml_nodes import compose

LARGE = 300  # lines; of longer manifests only the parts near the position are read
SMALL = 100  # lines; a section up to this size is always read
_MERGE = "<<"
_SECTION = re.compile(r"[A-Za-z_\"']")
_ENTRY = re.compile(r"( +)[^\s#]")


def quick_tree(text: str) -> TreeNode | None:
    """Return the tree of a text, None if it is not YAML; spans have no file, of a repeated key the last one counts.

    What an alias repeats is the same object again; an alias to something that contains it is an empty map.
    """
    root, _ = compose(text, "")
    return None if root is None else _node(root, {})


def _node(node: yaml.Node, done: dict[int, TreeNode]) -> TreeNode:
    start, end = node.start_mark, node.end_mark
    span = Span("", start.line + 1, start.column + 1, end.line + 1, end.column + 1)
    if isinstance(node, yaml.ScalarNode):
        return ScalarNode(node.value, span, not node.style)
    if id(node) in done:
        return done[id(node)]
    done[id(node)] = MappingNode({}, span)
    if isinstance(node, yaml.SequenceNode):
        made: TreeNode = SequenceNode(tuple(_node(item, done) for item in node.value), span)
    else:
        made = MappingNode(_entries(node.value, done), span)
    done[id(node)] = made
    return made


def _entries(pairs: list[tuple[yaml.Node, yaml.Node]], done: dict[int, TreeNode]) -> dict[str, Entry]:
    own: dict[str, Entry] = {}
    merged: dict[str, Entry] = {}
    for key_node, value_node in pairs:
        key, value = _node(key_node, done), _node(value_node, done)
        if isinstance(key, ScalarNode) and key.text == _MERGE and key.plain and isinstance(value, MappingNode):
            merged |= value.entries
        elif isinstance(key, ScalarNode):
            own[key.text] = Entry(key, value)
    return {**merged, **own}


def near(lines: list[str], line: int) -> list[str]:
    """Return the lines of a manifest, emptied where they are not needed to know what is at `line` (from 0).

    Small sections are kept, and of a large one the entry that contains the line: other names come from the robot.
    """
    starts = [number for number, text in enumerate(lines) if _SECTION.match(text)]
    kept = set(range(starts[0] if starts else 0))
    for start, end in pairwise([*starts, len(lines)]):
        if end - start <= SMALL:
            kept.update(range(start, end))
        elif start <= line < end:
            kept.update(_entry(lines, start, end, line))
    return [text if number in kept else "" for number, text in enumerate(lines)]


def _entry(lines: list[str], start: int, end: int, line: int) -> Iterator[int]:
    """Yield the lines of the section's entry that contains `line`, and the line of the section's name."""
    yield start
    first = next((match for text in lines[start + 1 : end] if (match := _ENTRY.match(text))), None)
    indent = first[1] if first else ""
    entries = [n for n in range(start + 1, end) if (match := _ENTRY.match(lines[n])) and match[1] == indent]
    for begin, after in pairwise([start + 1, *entries, end]):
        if begin <= line < after:
            yield from range(begin, after)
