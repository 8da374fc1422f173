"""`wait`: let time pass."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression, Number
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import duration
from rbxcompose.missions.program.families import LeafStep
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, ANY, RUNNING, SUCCESS, Outcomes
from rbxcompose.missions.program.program import Endings, MissionNode
from rbxcompose.missions.program.registry import kind


class WaitTask(Task):
    """Has a deadline."""

    __slots__ = ("deadline", "duration")
    saved = times = fresh = ("deadline",)

    def __init__(self, site: Site, step: WaitStep) -> None:
        super().__init__(site)
        self.duration = step.lasts
        self.deadline = 0.0

    def begin(self) -> int:
        """Set the deadline."""
        self.deadline = self.engine.time + self.number_of(self.duration, "a duration")
        return self.proceed()

    def proceed(self) -> int:
        """Succeed once the deadline has come."""
        return SUCCESS if self.engine.is_due(self.deadline) else RUNNING


@kind("wait", WaitTask)
@dataclass(frozen=True, slots=True)
class WaitStep(LeafStep):
    """Succeed after a time; after an interrupt, only the rest of it remains.

    Example:
        do:
          - wait: 5 s
          - go_to: corner_1
    """

    lasts: Expression = duration(least=0, counted="a wait")

    waits = True
    has_result = False
    only_asks = False

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return that it always succeeds if the duration is a literal."""
        return ALWAYS_SUCCEEDS if isinstance(self.lasts.tree, Number) else ANY
