"""`end`: the mission is over."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.text import Template
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import choice, text
from rbxcompose.missions.program.families import Deed, ends
from rbxcompose.missions.program.outcomes import FAILS, FAILURE, NEVER, RUNNING, SUCCEEDS, SUCCESS
from rbxcompose.missions.program.registry import kind


class EndTask(Task):
    """Ends the run that it belongs to."""

    __slots__ = ("step",)

    def __init__(self, site: Site, step: EndStep) -> None:
        super().__init__(site)
        self.step = step

    def begin(self) -> int:
        """Request the end of the run, which takes effect at the end of this tick."""
        message = self.run.filled(self.step.message, self.scope) if self.step.message else ""
        status = SUCCESS if self.step.result == SUCCEEDS else FAILURE
        if self.run.ending is None or (status, self.run.ending) == (FAILURE, SUCCESS):
            self.run.ending, self.run.message = status, message
            if status == FAILURE:
                self.engine.reasons[self.number] = message or "the mission ended itself in failure"
        return RUNNING


@kind("end", EndTask)
@dataclass(frozen=True, slots=True)
class EndStep(Deed):
    """End the mission that contains this node, in `success` or `failure`; what runs is halted.

    If two branches of a parallel end it in one tick, failure beats success.

    Example:
        do:
          if: $battery < 10 %
          then:
            end: failure
            message: The battery has only $battery
          else:
            go_to: corner_1
    """

    result: str = choice(SUCCEEDS, FAILS)
    message: Template | None = text("A message for the log.", optional=True)

    may_end = ends(NEVER)

    @property
    def ends_mission(self) -> str:
        """Return how the mission ends."""
        return self.result
