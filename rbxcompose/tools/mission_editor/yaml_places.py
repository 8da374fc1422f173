"""YAML text as nodes that know exactly where they are written, so that parts of the text can be moved as they are."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import field
from typing import Any

import yaml

from rbxcompose.base.dataclass import dataclass
from rbxcompose.manifest.yaml_nodes import compose

Path = tuple[str | int, ...]
PlainTree = Any
"""A tree without places, in lists that can be changed: `["list", [...]]`, `["map", [[key, value], ...]]`, scalars."""


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
