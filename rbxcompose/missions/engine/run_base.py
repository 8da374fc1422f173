"""One run of one mission as its tasks see it: its data, how texts are filled in, how it ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping

from rbxcompose.expressions.text import Template, fill
from rbxcompose.expressions.types import Type
from rbxcompose.expressions.values import Value
from rbxcompose.missions.engine import value_text
from rbxcompose.missions.engine.engine_base import EngineBase
from rbxcompose.missions.engine.resume_points import ResumableTask
from rbxcompose.missions.engine.scopes import MissionScope, RunScope
from rbxcompose.missions.program.program import Program, RobotNames


class RunBase(ABC):
    """What tasks know about the run of their mission, and a `use` about the run of the mission it uses.

    `begun` counts its starts.
    """

    def __init__(self, engine: EngineBase, program: Program, robot: RobotNames) -> None:
        self.engine = engine
        self.program = program
        self.data: dict[str, Value] = {}
        self.inputs: dict[str, Value] = {}
        self.scope = RunScope(self.data, self.inputs, robot.places, engine.world)
        self.begun = 0
        self.ending: int | None = None  # the status with which an `end` node ends it
        self.message = ""  # of that node
        self._types: dict[str, Type] = {
            **robot.values,
            **{name: one.type for name, one in program.inputs.items()},
            **{name: datum.type for name, datum in program.data.items()},
        }

    def show(self, name: str, value: Value) -> str:
        """Return the value of a name as text for people."""
        return value_text.show_briefly(self._types.get(name), value)

    def filled(self, template: Template, scope: MissionScope) -> str:
        """Return a text for people with its values filled in; names of places lose their underscores."""
        places = self.engine.robot.places
        return fill(template, scope, lambda name, value: self.show(name, value_text.spoken(value, places)))

    def written(self, template: Template, scope: MissionScope) -> str:
        """Return a text for programs with its values filled in; texts among these stay as they are."""
        return fill(template, scope, self.show)

    @abstractmethod
    def begin(self, inputs: Mapping[str, Value]) -> None:
        """Start afresh: initial data, nothing runs, every interrupt is armed."""

    @abstractmethod
    def begin_again(self) -> None:
        """Start again with the current data; nodes that keep their place resume there."""

    @abstractmethod
    def tick(self, now: float) -> int:
        """Check the interrupts, then continue with the course on top; return the status of the mission."""

    @abstractmethod
    def halt(self) -> None:
        """Stop what runs, for good."""

    @abstractmethod
    def suspend(self, from_start: bool) -> None:
        """Stop the running leaves, and keep the place."""

    @abstractmethod
    def main_tasks(self) -> Iterable[ResumableTask]:
        """Return the tasks of the main node that can keep a place."""
