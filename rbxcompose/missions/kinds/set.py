"""`set`: give new values to the mission's data."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.missions.program import Assignment
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@kind("set")
class Set(Task):
    """Compute all right sides first, then set them.

    Example:
        data:
          visited: 0
        do:
          - go_to: corner_1
          - set:
              visited: $visited + 1
          - log: $visited visited
    """

    __slots__ = ("assignments",)

    def __init__(self, site: Site, options: tuple[Assignment, ...]) -> None:
        super().__init__(site)
        self.assignments = options

    @staticmethod
    def read(reader: NodeReader) -> tuple[Assignment, ...]:
        """Read the map from names to expressions."""
        return reader.assignments(reader.key)

    def begin(self) -> int:
        """Set, and let everyone look once more at what may depend on it."""
        computed = {one.name: evaluate(one.asked.expression, self.scope) for one in self.assignments}
        self.run.data.update(computed)
        self.engine.again(self)
        return SUCCESS
