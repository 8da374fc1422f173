"""`check`: does a condition hold now?"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import holds
from rbxcompose.expressions.tree import Expression
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import FAILURE, SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@kind("check")
class Check(Task):
    """Succeed if the condition holds, else fail.

    Example:
        do:
          - check: $battery > 20 %
          - go_to: corner_1
    """

    __slots__ = ("condition",)

    def __init__(self, site: Site, options: Expression) -> None:
        super().__init__(site)
        self.condition = options

    @staticmethod
    def read(reader: NodeReader) -> Expression:
        """Read the condition."""
        return reader.condition(reader.key)

    def begin(self) -> int:
        """Ask."""
        return SUCCESS if holds(self.condition, self.scope) else FAILURE
