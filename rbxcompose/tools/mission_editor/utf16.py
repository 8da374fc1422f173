"""Places of a text in the units of a browser, which counts what is beyond 16 bits as two."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

_FIRST_PAIR = "\uffff"


class Utf16:
    """Turns offsets of a text into those of a browser, and back."""

    def __init__(self, text: str) -> None:
        self._wide = [index for index, one in enumerate(text) if one > _FIRST_PAIR] if not text.isascii() else []
        self._wide_there = [index + turn for turn, index in enumerate(self._wide)]
        self._starts = [0]
        for line in text.split("\n"):
            self._starts.append(self._starts[-1] + len(line) + 1)
        self._length = len(text)

    def at(self, offset: int) -> int:
        """Return an offset as a browser counts it."""
        return offset + bisect_left(self._wide, offset)

    def back(self, offset: int) -> int:
        """Return an offset of a browser as we count it."""
        return offset - bisect_left(self._wide_there, offset)

    def place(self, line: int, column: int) -> int:
        """Return the offset, for a browser, of a line and a column that count from 1."""
        line = min(max(line, 1), len(self._starts) - 1)
        return self.at(min(self._starts[line - 1] + column - 1, self._starts[line] - 1, self._length))

    def line(self, offset: int) -> int:
        """Return the line, from 1, of an offset of ours."""
        return bisect_right(self._starts, offset)
