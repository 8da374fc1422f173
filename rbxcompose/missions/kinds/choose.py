"""`choose`: one of several nodes, depending on a value."""

from __future__ import annotations

from rbxcompose.base.expressions.values import is_same
from rbxcompose.missions import sdk
from rbxcompose.missions.language.asked import Asked
from rbxcompose.missions.program.branches import BranchChoice


class ChooseTask(sdk.Task):
    """Runs the chosen case."""

    __slots__ = ("choice", "chosen", "index")
    saved = ("index",)

    def __init__(self, site: sdk.Site, step: ChooseStep) -> None:
        super().__init__(site)
        self.choice = step.choice
        self.chosen = site.children
        self.index = -1  # of the chosen child

    def begin(self) -> int:
        """Choose a case and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.index = self._choose()
        return sdk.SKIPPED if self.index < 0 else self.proceed()

    def proceed(self) -> int:
        """Continue with the chosen case."""
        return self.advance(self.chosen[self.index])

    def _choose(self) -> int:
        cases = self.choice.cases
        value = sdk.evaluate(self.choice.asked, self.scope)
        for index, case in enumerate(cases):
            if is_same(sdk.evaluate(case.expression, self.scope), value):
                return index
        return len(cases) if len(cases) < len(self.chosen) else -1


@sdk.kind("choose", ChooseTask)
@sdk.dataclass(frozen=True, slots=True)
class ChooseStep(sdk.Choosing):
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

    value: sdk.Expression = sdk.value("a value, such as '$room'")
    cases: tuple[Asked, ...] = sdk.cases("What is done for which value.")
    otherwise = sdk.child("What is done for all other values.", "else", optional=True)  # the last child

    sentence = sdk.says("Depending on {value}")

    def before(self, index: int) -> str:
        """Say the value of a case."""
        is_case = index < len(self.cases)
        return f"If it is {sdk.spoken(self.cases[index].expression)}" if is_case else "Otherwise"

    @property
    def choice(self) -> BranchChoice:
        """Return the value and the cases."""
        return BranchChoice(self.value, self.cases)

    @property
    def ways(self) -> tuple[str, ...]:
        """Return the cases, and `else` for all other values."""
        return (*(f"case {case.expression.text}" for case in self.cases), "else")

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes of all cases; a missing value is a failure."""
        found = sdk.ALWAYS_SUCCEEDS.both(sdk.either(map(endings.of, node.children)))
        return found.both(sdk.ALWAYS_FAILS) if node.asked else found
