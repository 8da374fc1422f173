"""What `sequence` and `fallback` share: nodes one after the other, until one of them decides."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rbxcompose.missions.statuses import RUNNING, SKIPPED
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


class InTurn(Task):
    """Does the nodes of a list in order; the first that ends as `decides` ends the list alike.

    If none does, it ends as those that were not skipped did.
    """

    __slots__ = ("children", "did", "index")
    decides: ClassVar[int]

    def __init__(self, site: Site, options: None) -> None:
        super().__init__(site)
        self.children = site.children
        self.index = 0
        self.did = SKIPPED

    @staticmethod
    def read(reader: NodeReader) -> None:
        """Read the list."""
        reader.steps()

    def begin(self) -> int:
        """Start with the first child."""
        self.index = 0
        self.did = SKIPPED
        return self.proceed()

    def proceed(self) -> int:
        """Go on with the child that runs, and with those behind it as far as they end at once."""
        children, index, child, decides = self.children, self.index, self.current, self.decides
        while True:
            if child is None:
                child = children[index]
                status = child.start()
            else:
                status = child.tick()
            if status == RUNNING:
                self.index, self.current = index, child
                return RUNNING
            child = None
            if status == decides:
                self.current = None
                return status
            if status != SKIPPED:
                self.did = status
            index += 1
            if index == len(children):
                self.current = None
                return self.did
