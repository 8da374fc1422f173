"""`choose`: one of several nodes, depending on a value."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.expressions.values import is_same
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.asked import Asked
from rbxcompose.missions.language.fields import cases, child, value
from rbxcompose.missions.program.branches import BranchChoice
from rbxcompose.missions.program.families import Choosing
from rbxcompose.missions.program.outcomes import ALWAYS_FAILS, ALWAYS_SUCCEEDS, SKIPPED, Outcomes, either
from rbxcompose.missions.program.program import Endings, MissionNode
from rbxcompose.missions.program.registry import kind


class ChooseTask(Task):
    """Runs the chosen case."""

    __slots__ = ("choice", "chosen", "index")
    saved = ("index",)

    def __init__(self, site: Site, step: ChooseStep) -> None:
        super().__init__(site)
        self.choice = step.choice
        self.chosen = site.children
        self.index = -1  # of the chosen child

    def begin(self) -> int:
        """Choose a case and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.index = self._choose()
        return SKIPPED if self.index < 0 else self.proceed()

    def proceed(self) -> int:
        """Continue with the chosen case."""
        return self.advance(self.chosen[self.index])

    def _choose(self) -> int:
        cases = self.choice.cases
        value = evaluate(self.choice.asked, self.scope)
        for index, case in enumerate(cases):
            if is_same(evaluate(case.expression, self.scope), value):
                return index
        return len(cases) if len(cases) < len(self.chosen) else -1


@kind("choose", ChooseTask)
@dataclass(frozen=True, slots=True)
class ChooseStep(Choosing):
    """Do the case that matches a value, which is read once; skipped without a match.

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

    value: Expression = value("a value, such as '$room'")
    cases: tuple[Asked, ...] = cases("What is done for which value.")
    otherwise = child("What is done for all other values.", "else", optional=True)  # the child after those of the cases

    @property
    def choice(self) -> BranchChoice:
        """Return the value and the cases."""
        return BranchChoice(self.value, self.cases)

    @property
    def ways(self) -> tuple[str, ...]:
        """Return the cases, and `else` for all other values."""
        return (*(f"case {case.expression.text}" for case in self.cases), "else")

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return the outcomes of all cases; a missing value is a failure."""
        found = ALWAYS_SUCCEEDS.both(either(map(endings.of, node.children)))
        return found.both(ALWAYS_FAILS) if node.asked else found
