"""`save`: keep the result of a node in the mission's data."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions.modifiers.registry import Modifier, modifier
from rbxcompose.missions.statuses import RUNNING
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader

SAVED = ("call", "use", "for")  # kinds that have something to keep, beside skills


@modifier("save")
class Save(Modifier):
    """Keep what a skill or a `call` answered, the outputs of a `use`, or `{done, failed}` of a `for`.

    It is kept also after a failure.

    Example:
        do:
          - for: corner
            in: [corner_1, corner_2]
            if_one_fails: next
            do:
              go_to: $corner
            optional: true
            save: tour
          - log: $tour.failed could not be reached
    """

    __slots__ = ("name",)

    def __init__(self, site: Site, options: Scalar, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.name = options.text

    @staticmethod
    def read(reader: NodeReader, key: str) -> Scalar:
        """Read the name."""
        return reader.name(key, "a name for the result")

    def begin(self) -> int:
        """Start the task inside."""
        return self.proceed()

    def proceed(self) -> int:
        """Go on, and keep the result at the end."""
        status = self.advance(self.inner)
        if status != RUNNING and self.name:
            self.run.data[self.name] = self.inner.result()
        return status
