"""Names that people chose in the files of a project: what a name belongs to, and where it is written."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.manifest.tree import KeyPath, ScalarNode

VARIABLE, ITEM, STATE, NODE, BRANCH, INTERRUPT = "variable", "item", "state", "node", "branch", "interrupt"
"""Sorts of names that missions define; those of other manifests are named like the section that defines them."""


@dataclass(frozen=True, slots=True)
class Symbol:
    """A name, by the file that defines it and its sort; `at` is the place that bounds it, if that is not the file."""

    file: Path
    sort: str
    name: str
    at: KeyPath = ()


@dataclass(frozen=True, slots=True)
class NamePiece:
    """A part of a word that is the name of a symbol: in `drive_battery`, an instance and a component of its part."""

    start: int
    end: int
    symbol: Symbol

    def shifted(self, offset: int) -> NamePiece:
        """Return the piece in a word that begins `offset` characters earlier."""
        return NamePiece(self.start + offset, self.end + offset, self.symbol)


@dataclass(frozen=True, slots=True)
class Mention:
    """A place where the name of a symbol is written, as offsets in the text of a file.

    Both are -1 if escapes or folded lines hide it.
    """

    symbol: Symbol
    file: Path
    start: int
    end: int
    is_definition: bool = False


class ScalarPlaces:
    """Finds the places of scalars in a text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._starts = [0]
        for line in text.split("\n"):
            self._starts.append(self._starts[-1] + len(line) + 1)

    def offset(self, line: int, column: int) -> int:
        """Return the offset of a position (from 0)."""
        return self._starts[min(line, len(self._starts) - 1)] + column

    def position(self, offset: int) -> tuple[int, int]:
        """Return the line and column (from 0) of an offset."""
        line = self.text.count("\n", 0, offset)
        return line, offset - self._starts[line]

    def of(self, scalar: ScalarNode, start: int, end: int) -> tuple[int, int]:
        """Return the offsets of `scalar.text[start:end]`; (-1, -1) if escapes or folded lines hide it."""
        span = scalar.span
        first = self.offset(span.line - 1, span.column - 1)
        raw = self.text[first : self.offset(span.end_line - 1, span.end_column - 1)]
        word = scalar.text[start:end]
        before, there = _finds(scalar.text, word), _finds(raw, word)
        # The same word in the same order: what YAML changes between the two is none of it.
        if len(before) != len(there) or start not in before:
            return -1, -1
        at = first + there[before.index(start)]
        return at, at + len(word)


def _finds(text: str, word: str) -> list[int]:
    found, at = [], text.find(word)
    while word and at >= 0:
        found.append(at)
        at = text.find(word, at + 1)
    return found
