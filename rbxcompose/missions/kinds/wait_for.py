"""`wait_for`: until a condition holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import holds
from rbxcompose.expressions.tree import Expression
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import IDLE, RUNNING, SUCCESS
from rbxcompose.missions.task import Site, Task
from rbxcompose.missions.watching import Watched

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.program import Node


@kind("wait_for")
class WaitFor(Task):
    """Succeed as soon as the condition holds; `timeout` bounds it.

    Example:
        do:
          wait_for: $battery > 50 %
          timeout: 1 min
    """

    __slots__ = ("watched",)

    def __init__(self, site: Site, options: Expression) -> None:
        super().__init__(site)
        self.watched = Watched.of(options)

    @staticmethod
    def read(reader: NodeReader) -> Expression:
        """Read the condition."""
        return reader.condition(reader.key)

    @staticmethod
    def waits(node: Node) -> bool:
        """It does nothing else."""
        return True

    def begin(self) -> int:
        """Ask for the first time."""
        return self.proceed()

    def proceed(self) -> int:
        """Ask again."""
        if holds(self.watched.condition, self.scope):
            return SUCCESS
        self.engine.watch(self.watched)
        return RUNNING

    def suspend(self, anew: bool) -> bool:
        """Nothing is to be stopped; after an interrupt it starts again."""
        if anew:
            self.statuses[self.number] = IDLE
        return anew
