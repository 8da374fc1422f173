"""A mission on a robot as the checks see it: its nodes with their scopes, and how each may end."""

from __future__ import annotations

from functools import cached_property

from rbxcompose.dataclass import dataclass
from rbxcompose.missions.analysis.endings import Ending
from rbxcompose.missions.analysis.scope_types import NodeScope, View, base_scope, views
from rbxcompose.missions.program.program import Program, RobotNames


@dataclass(frozen=True)
class Examined:
    """A mission, and what the robot offers it."""

    program: Program
    robot: RobotNames

    @cached_property
    def views(self) -> tuple[View, ...]:
        """Return each node with its scope, in the order of the text."""
        return tuple(views(self.program, self.robot))

    @cached_property
    def scope(self) -> NodeScope:
        """Return the scope of the whole mission."""
        return base_scope(self.program, self.robot)

    @cached_property
    def ending(self) -> Ending:
        """Return the analyser of how nodes may end."""
        return Ending(self.program, self.robot)
