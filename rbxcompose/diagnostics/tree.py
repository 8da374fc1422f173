"""The aggregated tree as it is told: its rows, and the last changes of levels."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from rbxcompose.dataclass import dataclass
from rbxcompose.diagnostics.requests import LevelChange
from rbxcompose.levels import Level
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus

MOST_CHANGES = 1000
_LONGEST = 200  # characters of a cause


@dataclass(frozen=True, slots=True)
class TreeRow:
    """A header or an item of the tree; `status.name` is its path, `depth` the number of headers above it."""

    name: str
    depth: int
    is_group: bool
    status: DiagnosticStatus


class LevelHistory:
    """The last changes of levels, at most `MOST_CHANGES`; all are counted."""

    def __init__(self) -> None:
        self._changes: deque[LevelChange] = deque(maxlen=MOST_CHANGES)
        self.count = 0

    def add(self, time: float, path: str, old: Level, new: Level, cause: str) -> None:
        """Add a change at robot time `time` [s]."""
        self.count += 1
        self._changes.append(LevelChange(self.count, time, path, old, new, cause[:_LONGEST]))

    def after(self, number: int) -> Iterable[LevelChange]:
        """Return the changes with greater numbers that are still known, oldest first; all if there never was one."""
        known = min(self.count - (number if number <= self.count else 0), len(self._changes))
        return list(self._changes)[len(self._changes) - known :] if known > 0 else []
