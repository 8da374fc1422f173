"""`choose`: one of several nodes, by a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import UNKNOWN
from rbxcompose.expressions.values import is_same
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SKIPPED
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.program import Asked


@dataclass(frozen=True, slots=True)
class ChooseOptions:
    """What is asked, and the value of each case, in the order of the children; `else` is the last child."""

    asked: Expression
    cases: tuple[Asked, ...] = ()
    has_else: bool = False


@kind("choose", {"cases": "What is done for which value.", "else": "What is done for all other values."})
class Choose(Task):
    """Do the case of a value, which is asked once; without a match it is skipped.

    Example:
        data:
          room: kitchen
        do:
          choose: $room
          cases:
            kitchen:
              log: Mopping
            hallway:
              log: Sweeping
          else:
            log: Nothing to do in $room
    """

    __slots__ = ("chosen", "index", "options")
    saved = ("index",)

    def __init__(self, site: Site, options: ChooseOptions) -> None:
        super().__init__(site)
        self.options = options
        self.chosen = site.children
        self.index = -1  # of the child that was chosen

    @staticmethod
    def read(reader: NodeReader) -> ChooseOptions:
        """Read the value, `cases` and `else`."""
        asked = reader.expression(reader.key, UNKNOWN, "a value, such as '$room'")
        cases = reader.cases("cases")
        if reader.has("else"):
            reader.child("else")
        return ChooseOptions(asked, cases, reader.has("else"))

    def begin(self) -> int:
        """Choose, and start what was chosen."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.index = self._choose()
        return SKIPPED if self.index < 0 else self.proceed()

    def proceed(self) -> int:
        """Go on with what was chosen."""
        return self.advance(self.chosen[self.index])

    def _choose(self) -> int:
        value = evaluate(self.options.asked, self.scope)
        for index, case in enumerate(self.options.cases):
            if is_same(evaluate(case.expression, self.scope), value):
                return index
        return len(self.options.cases) if self.options.has_else else -1
