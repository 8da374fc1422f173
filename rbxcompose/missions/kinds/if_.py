"""`if`: one node or another, depending on a condition."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.missions.analysis.facts import is_simple
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import child, condition
from rbxcompose.missions.program.families import Choosing
from rbxcompose.missions.program.outcomes import ALWAYS_FAILS, ALWAYS_SUCCEEDS, SKIPPED, Outcomes, either
from rbxcompose.missions.program.program import Endings, MissionNode
from rbxcompose.missions.program.registry import kind


class IfTask(Task):
    """Runs the chosen branch."""

    __slots__ = ("branches", "condition", "index")
    saved = ("index",)

    def __init__(self, site: Site, step: IfStep) -> None:
        super().__init__(site)
        self.condition = step.condition
        self.branches = site.children
        self.index = 0  # of the chosen branch

    def begin(self) -> int:
        """Choose a branch and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.index = 0 if holds(self.condition, self.scope) else 1
        return self.proceed() if self.index < len(self.branches) else SKIPPED

    def proceed(self) -> int:
        """Continue with the chosen branch."""
        return self.advance(self.branches[self.index])


@kind("if", IfTask)
@dataclass(frozen=True, slots=True)
class IfStep(Choosing):
    """Evaluate a condition once, then do `then` or `else`; skipped without a match.

    Example:
        do:
          if: $battery < 90 %
          then:
            - go_to: dock
            - recharge
          else:
            log: The battery has $battery
    """

    condition: Expression = condition()
    then = child("What is done if the condition holds.")
    otherwise = child("What is done if it does not.", "else", optional=True)

    ways = ("then", "else")

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return the outcomes of both branches; a condition that cannot be evaluated is a failure."""
        found = ALWAYS_SUCCEEDS.both(either(map(endings.of, node.children)))
        return found if is_simple(node) else found.both(ALWAYS_FAILS)
