"""`log`: say something in the robot's story."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.expressions.text import Template
from rbxcompose.missions.events import Logged
from rbxcompose.missions.moments import LEVELS
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@dataclass(frozen=True, slots=True)
class LogOptions:
    """What is said, and how bad it is."""

    text: Template
    level: str


@kind("log", {"level": "How bad it is."})
class Log(Task):
    """Write one line; `$name` in it is filled in.

    Example:
        do:
          log: The battery has $battery
          level: warn
    """

    __slots__ = ("options",)

    def __init__(self, site: Site, options: LogOptions) -> None:
        super().__init__(site)
        self.options = options

    @staticmethod
    def read(reader: NodeReader) -> LogOptions:
        """Read the text and `level`."""
        return LogOptions(reader.template(reader.key), reader.choice("level", LEVELS))

    def begin(self) -> int:
        """Say it."""
        self.engine.say(Logged(self.options.level, self.run.filled(self.options.text, self.scope)))
        return SUCCESS
