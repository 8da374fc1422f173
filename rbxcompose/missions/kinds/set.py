"""`set`: give new values to the mission's data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.types import COUNT, quantity_of
from rbxcompose.findings import Finding, correction, suggest
from rbxcompose.missions import codes
from rbxcompose.missions.program import Assignment
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SUCCESS
from rbxcompose.missions.task import Site, Task
from rbxcompose.units import NUMBER

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.views import View


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
        return reader.assignments()

    @staticmethod
    def check(view: View) -> Iterator[Finding]:
        """Only data can be set, to values of their type."""
        assignments = view.node.options if isinstance(view.node.options, tuple) else ()
        for assignment in assignments:
            name, asked, data = assignment.name, assignment.asked, view.program.data
            if name not in data:
                message = f"only data can be set; the mission has no datum '{name}'"
                help_text = suggest(name, data, "its data") or f"write '{name}: ...' under 'data'"
                taken = [one.name for one in assignments]
                fix = correction(name, data, assignment.span, taken=taken)
                yield codes.UNKNOWN_NAME.at(assignment.span, message, help=help_text, fix=fix)
            else:
                wanted = quantity_of(NUMBER) if data[name].type == COUNT else data[name].type
                yield from view.typed(asked.expression, wanted, asked.scalar, codes.WRONG_TYPE)

    def begin(self) -> int:
        """Set, and let everyone look once more at what may depend on it."""
        computed = {one.name: evaluate(one.asked.expression, self.scope) for one in self.assignments}
        self.engine.data.update(computed)
        self.engine.again(self)
        return SUCCESS
