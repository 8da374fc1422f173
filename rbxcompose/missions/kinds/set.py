"""`set`: give new values to the mission's data."""

from __future__ import annotations

from rbxcompose.missions import sdk
from rbxcompose.missions.engine.instant_actions import assign
from rbxcompose.missions.language.asked import Assignment


class SetTask(sdk.Task):
    """Sets the data once."""

    __slots__ = ("assignments",)

    def __init__(self, site: sdk.Site, step: SetStep) -> None:
        super().__init__(site)
        self.assignments = step.assignments

    def begin(self) -> int:
        """Set the data."""
        assign(self.assignments, self)
        return sdk.SUCCESS


@sdk.kind("set", SetTask)
@sdk.dataclass(frozen=True, slots=True)
class SetStep(sdk.Deed):
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

    assignments: tuple[Assignment, ...] = sdk.assignments()

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say what is set to what."""
        return sdk.set_in_words(self.assignments)

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it fails only if it cannot read a value."""
        return sdk.ALWAYS_SUCCEEDS if sdk.is_sure(node, endings.program, endings.robot) else sdk.ANY

    def text(self, node: sdk.MissionNode) -> str:
        """Return the assignments as text."""
        return ", ".join(f"{assignment.name} = {assignment.asked.scalar.text}" for assignment in self.assignments)

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the assignments."""
        return sdk.NodeEffects(assignments=self.assignments)
