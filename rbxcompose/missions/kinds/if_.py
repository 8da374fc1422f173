"""`if`: one node or another, by a condition."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import holds
from rbxcompose.expressions.tree import Expression
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SKIPPED
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@kind("if", {"then": "What is done if the condition holds.", "else": "What is done if it does not."})
class If(Task):
    """Ask the condition once, then do `then` or `else`; without a match it is skipped.

    Example:
        do:
          if: $battery < 90 %
          then:
            - go_to: dock
            - recharge
          else:
            log: The battery has $battery
    """

    __slots__ = ("branches", "condition", "index")
    saved = ("index",)

    def __init__(self, site: Site, options: Expression) -> None:
        super().__init__(site)
        self.condition = options
        self.branches = site.children
        self.index = 0  # of the one that was chosen

    @staticmethod
    def read(reader: NodeReader) -> Expression:
        """Read the condition, `then` and `else`."""
        condition = reader.condition(reader.key)
        reader.child("then")
        if reader.has("else"):
            reader.child("else")
        return condition

    def begin(self) -> int:
        """Choose, and start what was chosen."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.index = 0 if holds(self.condition, self.scope) else 1
        return self.proceed() if self.index < len(self.branches) else SKIPPED

    def proceed(self) -> int:
        """Go on with what was chosen."""
        return self.advance(self.branches[self.index])
