"""YAML text as nodes that know exactly where they are written, and changes of it.

Parts of the text can be moved as they are: every byte that does not belong to a change stays. What comes of a change is
parsed again, and refused if it is not exactly the tree that was meant.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import field
from itertools import pairwise
from typing import Any

import yaml

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused
from rbxcompose.manifest.yaml_nodes import compose

Path = tuple[str | int, ...]
PlainTree = Any
"""A tree without places, in lists that can be changed: `["list", [...]]`, `["map", [[key, value], ...]]`, scalars."""
INDENT = 2
SCALAR_MARK = (None, None, "")  # the mark of a scalar without quotes
BLOCK_MARK = (None, None)  # of a list or a map


@dataclass(slots=True)
class PlacedNode:
    """A node; `start` and `end` are offsets of what is written, without the comments around it.

    `form` is 'scalar', 'list', 'map' or 'alias'. `is_flow` means that a list or a map is in brackets, `mark` is its
    anchor, tag and style.
    """

    form: str
    start: int
    end: int
    text: str = ""
    mark: tuple[object, ...] = ()
    is_flow: bool = False
    items: list[PlacedNode] = field(default_factory=list)
    pairs: list[tuple[PlacedNode, PlacedNode]] = field(default_factory=list)

    def get(self, key: str) -> PlacedNode | None:
        """Return the value of a key."""
        return next((value for name, value in self.pairs if name.text == key and name.form == "scalar"), None)

    def at(self, path: Path) -> PlacedNode | None:
        """Return the node at a path below this one."""
        found: PlacedNode | None = self
        for key in path:
            if found is None:
                return None
            if isinstance(key, int):
                found = found.items[key] if 0 <= key < len(found.items) else None
            else:
                found = found.get(key)
        return found

    def plain(self) -> PlainTree:
        """Return what is written, without places."""
        if self.form == "list":
            return ["list", [item.plain() for item in self.items], self.mark]
        if self.form == "map":
            return ["map", [[key.plain(), value.plain()] for key, value in self.pairs], self.mark]
        return (self.form, self.text, self.mark)

    def all(self) -> Iterator[PlacedNode]:
        """Yield it and all below it."""
        yield self
        for item in self.items:
            yield from item.all()
        for key, value in self.pairs:
            yield from key.all()
            yield from value.all()


def placed(text: str) -> PlacedNode | None:
    """Return the node of a text; None if it is empty or cannot be read, which `check` reports."""
    if compose(text, "")[0] is None:
        return None
    shift = 1 if text.startswith("\ufeff") else 0
    events = iter(yaml.parse(text[shift:], Loader=yaml.CSafeLoader))
    for event in events:
        if isinstance(event, yaml.DocumentStartEvent):
            return _Builder(events, shift, text).node(next(events))
    return None


class _Builder:
    """Makes nodes of events; `compose` has seen to it that they are not nested too deep."""

    def __init__(self, events: Iterator[Any], shift: int, text: str) -> None:
        self.events, self.shift, self.text = events, shift, text

    def node(self, event: Any) -> PlacedNode:
        start, end = event.start_mark.index + self.shift, event.end_mark.index + self.shift
        match event:
            case yaml.AliasEvent():
                return PlacedNode("alias", start, end, str(event.anchor))
            case yaml.ScalarEvent():
                # A block scalar ends where the next token begins.
                stop = end if event.style not in ("|", ">") else start + len(self.text[start:end].rstrip())
                return PlacedNode("scalar", start, stop, event.value, (event.anchor, event.tag, event.style))
            case yaml.SequenceStartEvent():
                made = PlacedNode("list", start, end, "", (event.anchor, event.tag), bool(event.flow_style))
                while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
                    made.items.append(self.node(event))
            case _:
                made = PlacedNode("map", start, end, "", (event.anchor, event.tag), bool(event.flow_style))
                while not isinstance(event := next(self.events), yaml.MappingEndEvent):
                    key = self.node(event)
                    made.pairs.append((key, self.node(next(self.events))))
        if made.is_flow:
            made.end = event.end_mark.index + self.shift
        elif made.items:
            made.end = made.items[-1].end
        elif made.pairs:
            key, value = made.pairs[-1]
            made.end = max(value.end, key.end + 1)  # with the colon
        return made


class TextLines:
    """A text by its lines, which count from 0; `count` is without an empty one at the end."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines = text.split("\n")
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line) + 1)
        self.is_open = not text.endswith("\n") and bool(text)  # its last line has no end
        self.count = len(self.lines) - (0 if self.is_open else 1)

    def of(self, offset: int) -> int:
        """Return the line of an offset."""
        return bisect_right(self.starts, offset) - 1

    def column(self, offset: int) -> int:
        """Return how far an offset is from the beginning of its line."""
        return offset - self.starts[self.of(offset)]

    def begins(self, offset: int) -> bool:
        """Return whether only spaces are before an offset in its line."""
        return not self.text[self.starts[self.of(offset)] : offset].strip(" ")

    def is_comment(self, line: int) -> bool:
        """Return whether a line is nothing but a comment."""
        return self.lines[line].lstrip(" ").startswith("#")

    def indent(self, line: int) -> int:
        """Return how many spaces begin a line."""
        return len(self.lines[line]) - len(self.lines[line].lstrip(" "))

    def region(self, start: int, end: int, column: int) -> tuple[int, int]:
        """Return the lines (the last one exclusive) that belong to what is written between two offsets.

        Comments right above it at its own column, and right below it further right, are its own.
        """
        first, last = self.of(start), self.of(max(end - 1, start)) + 1
        while first > 0 and self.is_comment(first - 1) and self.indent(first - 1) == column:
            first -= 1
        while last < self.count and self.is_comment(last) and self.indent(last) > column:
            last += 1
        return first, last

    def place(self, line: int) -> int:
        """Return the offset of a line, or of the end of the text."""
        return self.starts[line] if line < self.count else len(self.text)


class Utf16(TextLines):
    """Places of a text in the units of a browser, which counts what is beyond 16 bits as two."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._wide = [index for index, one in enumerate(text) if one > "\uffff"] if not text.isascii() else []

    def at(self, offset: int) -> int:
        """Return an offset as a browser counts it."""
        return offset + bisect_left(self._wide, offset)

    def offset(self, line: int, column: int) -> int:
        """Return the offset, for a browser, of a line and a column that count from 1."""
        line = min(max(line, 1), len(self.lines))
        return self.at(min(self.starts[line - 1] + column - 1, self.starts[line] - 1, len(self.text)))


@dataclass(frozen=True, slots=True)
class TextEdit:
    """Replaces what is between two offsets of a text."""

    start: int
    end: int
    text: str


@dataclass(frozen=True, slots=True)
class TextPatch:
    """Edits that do not overlap, in the order of the text, and the path of what is chosen afterwards."""

    edits: tuple[TextEdit, ...]
    chosen: Path

    def applied(self, text: str) -> str:
        """Return a text with the edits."""
        for edit in reversed(self.edits):
            text = f"{text[: edit.start]}{edit.text}{text[edit.end :]}"
        return text


class YamlPatch:
    """Collects the edits of one change of a text, and what its tree is to be afterwards.

    `BY_HAND` is what people can do if that is impossible, `OVERLAP` what it means that two edits meet.
    """

    BY_HAND = ""
    OVERLAP = ELSE = "this cannot be done without changing something else"

    def __init__(self, lines: TextLines, root: PlacedNode) -> None:
        self.lines, self.root = lines, root
        self.tree: PlainTree = root.plain()
        self.edits: list[TextEdit] = []

    def replace(self, start: int, end: int, text: str) -> None:
        """Write a text in place of what is between two offsets."""
        self.edits.append(TextEdit(start, end, text))

    def cut(self, first: int, last: int) -> None:
        """Take lines away."""
        start, end = self.lines.starts[first], self.lines.place(last)
        if last >= self.lines.count and self.lines.is_open and start > 0:
            start -= 1  # with the end of the line before
        self.replace(start, end, "")

    def paste(self, line: int, block: str) -> None:
        """Write lines before another one."""
        at = self.lines.place(line)
        is_behind = line >= self.lines.count and self.lines.is_open
        self.replace(at, at, f"\n{block}" if is_behind else f"{block}\n")

    def done(self, chosen: Path = ()) -> TextPatch:
        """Return the change, if it does what was meant and nothing else.

        Raises:
            Refused: if it does not.
        """
        edits = sorted(self.edits, key=lambda edit: (edit.start, edit.end))
        if any(other.start < one.end for one, other in pairwise(edits)):
            raise Refused(f"{self.OVERLAP}: {self.BY_HAND}")
        made = TextPatch(tuple(edits), chosen)
        root = placed(made.applied(self.lines.text))
        if root is None or root.plain() != self.tree:
            raise Refused(f"{self.ELSE}: {self.BY_HAND}")
        return made


def tree_at(tree: PlainTree, path: Path) -> PlainTree:
    """Return what is at a path of a tree."""
    for key in path:
        tree = tree[1][key] if isinstance(key, int) else pair_in(tree, key)[1]
    return tree


def pair_in(tree: PlainTree, key: str | int) -> PlainTree:
    """Return the key and the value of an entry of a map, which can be replaced there."""
    return next(pair for pair in tree[1] if pair[0][1] == key)


def put_into(tree: PlainTree, key: str | int, value: PlainTree) -> None:
    """Replace a value of a list or a map."""
    if isinstance(key, int):
        tree[1][key] = value
    else:
        pair_in(tree, key)[1] = value


def take_out(tree: PlainTree, key: str | int) -> None:
    """Take a value out of a list or a map."""
    if isinstance(key, int):
        del tree[1][key]
    else:
        tree[1].remove(pair_in(tree, key))
