"""`log`: write a line to the robot's log."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.text import Template
from rbxcompose.missions.analysis.facts import is_sure
from rbxcompose.missions.engine.events import Logged
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import choice, text
from rbxcompose.missions.program.answers import LEVELS
from rbxcompose.missions.program.families import Deed
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, ANY, SUCCESS, Outcomes
from rbxcompose.missions.program.program import Endings, MissionNode
from rbxcompose.missions.program.registry import kind


class LogTask(Task):
    """Writes one line."""

    __slots__ = ("step",)

    def __init__(self, site: Site, step: LogStep) -> None:
        super().__init__(site)
        self.step = step

    def begin(self) -> int:
        """Write it."""
        self.engine.say(Logged(self.step.level, self.run.filled(self.step.template, self.scope)))
        return SUCCESS


@kind("log", LogTask)
@dataclass(frozen=True, slots=True)
class LogStep(Deed):
    """Write one line; `$name` in it is filled in.

    Example:
        do:
          log: The battery has $battery
          level: warn
    """

    template: Template = text()
    level: str = choice(*LEVELS, help="Its severity.")

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return that it fails only if it cannot read a value."""
        return ALWAYS_SUCCEEDS if is_sure(node, endings.program, endings.robot) else ANY
