"""`wait`: let time pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.expressions.tree import Expression
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import RUNNING, SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.program import Node


@kind("wait")
class Wait(Task):
    """Succeed after a time; it goes on with the rest when the mission was cut short meanwhile.

    Example:
        do:
          - wait: 5 s
          - go_to: corner_1
    """

    __slots__ = ("deadline", "duration")
    saved = ("deadline",)

    def __init__(self, site: Site, options: Expression) -> None:
        super().__init__(site)
        self.duration = options
        self.deadline = 0.0

    @staticmethod
    def read(reader: NodeReader) -> Expression:
        """Read the duration."""
        return reader.duration(reader.key)

    @staticmethod
    def waits(node: Node) -> bool:
        """It does nothing else."""
        return True

    def begin(self) -> int:
        """Set the deadline."""
        self.deadline = self.engine.time + self.number_of(self.duration, "a duration")
        return self.proceed()

    def proceed(self) -> int:
        """See whether the time has come."""
        return SUCCESS if self.engine.is_due(self.deadline) else RUNNING
