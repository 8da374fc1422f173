"""What people may ask of the diagnostics of a running robot."""

from __future__ import annotations

import shlex

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Query

TYPE = "diagnostics"
NOT_YET = "has not reported yet"
"""Message of a part of the robot that has just started."""


@dataclass(frozen=True, slots=True)
class TreeLine:
    """A group or an item of the tree; `path` is that of `/diagnostics_agg`, `depth` counts the groups above it."""

    path: str
    name: str
    depth: int
    is_group: bool
    level: Level
    message: str
    hardware_id: str = ""
    values: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class DiagnosticsTree:
    """The tree at robot time `time` [s], with the level of the robot and its cause.

    `left_out` counts the lines for which there was no room, `dropped` the statuses refused since the start.
    """

    time: float
    level: Level
    cause: str
    lines: tuple[TreeLine, ...]
    left_out: int = 0
    dropped: int = 0


@dataclass(frozen=True, slots=True)
class ShowDiagnostics(Query[DiagnosticsTree]):
    """Return the tree."""

    about = TYPE


@dataclass(frozen=True, slots=True)
class LevelChange:
    """A change of the level of a group or an item at robot time `time` [s]; `number` counts all changes."""

    number: int
    time: float
    path: str
    old: Level
    new: Level
    cause: str


@dataclass(frozen=True, slots=True)
class ListChanges(Query[tuple[LevelChange, ...]]):
    """Return the changes after number `after` that are still known, oldest first; of many, only the first.

    Whoever wants all asks again, after the last one, until there are none.
    """

    about = TYPE
    after: int = 0


@dataclass(frozen=True, slots=True)
class LatchedLevel:
    """A level that is latched since a robot time [s], with its cause; `key` are the analyzers down to its group."""

    key: tuple[str, ...]
    level: Level
    since: float
    message: str


@dataclass(frozen=True, slots=True)
class RecallLatches(Command):
    """Go on with the levels that were latched before a restart."""

    about = TYPE
    latched: tuple[LatchedLevel, ...]


@dataclass(frozen=True, slots=True)
class Acknowledge(Command):
    """Let the latched levels of a group, and of those below it, follow the present again; all if `path` is empty."""

    about = TYPE
    path: str = ""

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["diag", "ack", *([self.path] if self.path else [])])
