"""The story of a run for people: a line for each record, and a summary at the end."""

import zlib
from collections import Counter
from collections.abc import Iterable, Mapping

from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.runtime.log import Record

_LONGEST = 2000  # maximum characters shown of a record's text
_RESET, _FAINT = "\x1b[0m", "\x1b[2m"
_LEVELS = {Level.WARN: "\x1b[33m", Level.ERROR: "\x1b[1;31m", Level.STALE: "\x1b[35m"}
_SOURCES = ("\x1b[36m", "\x1b[32m", "\x1b[34m", "\x1b[96m", "\x1b[92m", "\x1b[94m")


class StoryWriter:
    """Writes records as lines; the source column is as wide as the longest name that will come."""

    def __init__(self, sources: Iterable[str], *, colour: bool) -> None:
        self._width = max((len(name) for name in (*sources, "robot")), default=0)
        self._colour = colour

    def line(self, record: Record) -> str:
        """Return one record, without a newline: `   22.55  mission  go_to corner_1`."""
        source = f"{plain(record.source):<{self._width}}"
        text = plain(record.text, _LONGEST)
        if record.level is not Level.OK:
            text = f"{record.level.name.lower()}: {text}"
        if self._colour:
            # The same source has the same colour in every run.
            paint = _SOURCES[zlib.crc32(record.source.encode(errors="replace")) % len(_SOURCES)]
            source = f"{paint}{source}{_RESET}"
            text = f"{_LEVELS[record.level]}{text}{_RESET}" if record.level in _LEVELS else text
            return f"{_FAINT}{record.time:8.2f}{_RESET}  {source}  {text}"
        return f"{record.time:8.2f}  {source}  {text}"


def summary(robot: str, reason: str, time: float, facts: Mapping[str, Mapping[str, str]]) -> str:
    """Return how the run of `robot` ended: the reason, robot time [s], and facts by instance and label, aligned."""
    labels = Counter(label for some in facts.values() for label in some)
    lines = [("robot time", f"{time:.2f} s")]
    for instance in sorted(facts):
        for label, text in facts[instance].items():
            lines.append((label if labels[label] == 1 else f"{instance} {label}", text))
    width = max(len(label) for label, _ in lines)
    rows = [f"  {plain(label):<{width}}  {plain(text)}" for label, text in lines]
    return "\n".join([f"{robot} is down: {plain(reason)}", *rows])
