"""`check`: does a condition hold now?"""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import condition
from rbxcompose.missions.program.families import LeafStep, ends
from rbxcompose.missions.program.outcomes import ANY, FAILURE, SUCCESS
from rbxcompose.missions.program.registry import kind


class CheckTask(Task):
    """Evaluates the condition once."""

    __slots__ = ("condition",)

    def __init__(self, site: Site, step: CheckStep) -> None:
        super().__init__(site)
        self.condition = step.condition

    def begin(self) -> int:
        """Evaluate the condition."""
        return SUCCESS if holds(self.condition, self.scope) else FAILURE


@kind("check", CheckTask)
@dataclass(frozen=True, slots=True)
class CheckStep(LeafStep):
    """Succeed if the condition holds, else fail.

    Example:
        do:
          - check: $battery > 20 %
          - go_to: corner_1
    """

    condition: Expression = condition()

    waits = False
    has_result = False
    lasts = None
    only_asks = True

    may_end = ends(ANY)
