"""What a program writes, as lines of the log: each with its level, and not too many of them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain

LONGEST = 500  # characters of a line in the log
AT_ONCE, PER_SECOND = 200, 20  # lines that are logged at once, and for a long time
TELLS = 10.0  # [s] between two records of how many were left out
_COLOURS = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
_USUAL = {Level.ERROR: r"\b(ERROR|FATAL|CRITICAL|Error|Traceback)\b", Level.WARN: r"\b(WARN|WARNING|Warning)\b"}
"""How loggers mark their lines: those of ROS 2, Python, and most others."""


class OutputLog:
    """Turns lines into records; a program that floods its output loses the rest, which is counted."""

    def __init__(self, patterns: Mapping[Level, str]) -> None:
        """Take regular expressions by level, instead of the usual marks; ERROR counts before WARN."""
        given = {**_USUAL, **patterns}
        self._patterns = [(level, re.compile(given[level])) for level in (Level.ERROR, Level.WARN)]
        self._credit, self._since = float(AT_ONCE), 0.0
        self._left_out, self._told = 0, -TELLS

    def take(self, lines: Iterable[str], now: float) -> Iterator[tuple[Level, str]]:
        """Yield the records of lines that came at `now` [s]; infinite at its end, so that nothing is left untold."""
        self._credit = min(float(AT_ONCE), self._credit + (now - self._since) * PER_SECOND)
        self._since = now
        for line in lines:
            text = _COLOURS.sub("", line).rstrip()
            if not text:
                continue
            if self._credit < 1.0:
                self._left_out += 1
                continue
            self._credit -= 1.0
            yield self._level(text), plain(text, LONGEST)
        if self._left_out and now - self._told >= TELLS:
            number, self._left_out, self._told = self._left_out, 0, now
            lines_were = "one line was" if number == 1 else f"{number} lines were"
            yield Level.WARN, f"{lines_were} left out: it writes too many"

    def _level(self, text: str) -> Level:
        return next((level for level, pattern in self._patterns if pattern.search(text)), Level.OK)
