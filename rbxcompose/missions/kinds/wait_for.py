"""`wait_for`: until a condition holds."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.missions.analysis.facts import is_simple
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.engine.world import Watched
from rbxcompose.missions.language.fields import watched
from rbxcompose.missions.program.families import LeafStep
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, ANY, IDLE, RUNNING, SUCCESS, Outcomes
from rbxcompose.missions.program.program import Endings, MissionNode
from rbxcompose.missions.program.registry import kind


class WaitForTask(Task):
    """Evaluates the condition whenever its value may have changed."""

    __slots__ = ("watched",)

    def __init__(self, site: Site, step: WaitForStep) -> None:
        super().__init__(site)
        self.watched = Watched.of(step.condition)

    def begin(self) -> int:
        """Evaluate the condition for the first time."""
        return self.proceed()

    def proceed(self) -> int:
        """Evaluate the condition again."""
        if holds(self.watched.condition, self.scope):
            return SUCCESS
        self.engine.watch(self.watched)
        return RUNNING

    def suspend(self, from_start: bool) -> bool:
        """Return whether it starts again; there is nothing to stop."""
        if from_start:
            self.statuses[self.number] = IDLE
        return from_start


@kind("wait_for", WaitForTask)
@dataclass(frozen=True, slots=True)
class WaitForStep(LeafStep):
    """Succeed as soon as the condition holds; `timeout` limits the wait.

    Example:
        do:
          wait_for: $battery > 50 %
          timeout: 1 min
    """

    condition: Expression = watched()

    waits = True
    has_result = False
    lasts = None
    only_asks = True

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return that it succeeds; only a condition that cannot be evaluated is a failure."""
        return ALWAYS_SUCCEEDS if is_simple(node) else ANY
