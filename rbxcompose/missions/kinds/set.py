"""`set`: give new values to the mission's data."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.analysis.facts import is_sure
from rbxcompose.missions.engine.instant_actions import assign
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.asked import Assignment
from rbxcompose.missions.language.fields import assignments
from rbxcompose.missions.program.answers import NodeEffects
from rbxcompose.missions.program.families import Deed
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, ANY, SUCCESS, Outcomes
from rbxcompose.missions.program.program import Endings, MissionNode
from rbxcompose.missions.program.registry import kind


class SetTask(Task):
    """Sets the data once."""

    __slots__ = ("assignments",)

    def __init__(self, site: Site, step: SetStep) -> None:
        super().__init__(site)
        self.assignments = step.assignments

    def begin(self) -> int:
        """Set the data."""
        assign(self.assignments, self)
        return SUCCESS


@kind("set", SetTask)
@dataclass(frozen=True, slots=True)
class SetStep(Deed):
    """Compute all right-hand sides first, then set them.

    Example:
        data:
          visited: 0
        do:
          - go_to: corner_1
          - set:
              visited: $visited + 1
          - log: $visited visited
    """

    assignments: tuple[Assignment, ...] = assignments()

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return that it fails only if it cannot read a value."""
        return ALWAYS_SUCCEEDS if is_sure(node, endings.program, endings.robot) else ANY

    def text(self, node: MissionNode) -> str:
        """Return the assignments as text."""
        return ", ".join(f"{assignment.name} = {assignment.asked.scalar.text}" for assignment in self.assignments)

    @property
    def effects(self) -> NodeEffects:
        """Return the assignments."""
        return NodeEffects(assignments=self.assignments)
