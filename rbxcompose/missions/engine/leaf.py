"""A leaf that requests something of the robot and waits for the response: a skill, a call of a service."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from rbxcompose.expressions.values import Value
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.program.results import Result
from rbxcompose.missions.program.statuses import FAILURE, IDLE, RUNNING, SUCCESS


class Leaf(Task):
    """Asks when it begins, and returns the result once it has come; kinds fill in `ask`."""

    __slots__ = ("is_asked", "is_held", "outcome", "status", "values")
    saved: ClassVar[tuple[str, ...]] = ("is_asked", "is_held", "outcome", "status", "values")

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self.is_asked = False  # the world is at it, and has not told how it ended
        self.is_held = False  # the world holds it, to go on later
        self.status = IDLE
        self.outcome = ""
        self.values: Mapping[str, Value] = {}

    def proceed(self) -> int:
        """Return the result, once there is one; ask again what was stopped."""
        if self.is_held:
            self.is_held = False
            self.engine.world.resume(self.number)
        if self.is_asked:
            return RUNNING
        if self.status == RUNNING:
            return self.ask()
        self.engine.outcome = self.outcome
        return self.status

    def ask(self) -> int:
        """Ask, and return the status; what it raises is a failure of the node."""
        raise NotImplementedError

    def ended(self, result: Result) -> None:
        """Take the result from the world."""
        self.is_asked = self.is_held = False
        self.values = result.values
        self.status, self.outcome, message = self.judged(result)
        if self.status == FAILURE:
            self.engine.reasons[self.number] = message

    def judged(self, result: Result) -> tuple[int, str, str]:
        """Return the status that a result counts as, its outcome and its message."""
        return (SUCCESS if result.success else FAILURE), "", result.message

    def result(self) -> Value:
        """Return what it found out."""
        return dict(self.values)

    def halt(self) -> None:
        """Ask the world to stop it."""
        super().halt()
        self.stop()

    def stop(self) -> None:
        """Stop what the world is at."""
        if self.is_asked:
            self.is_asked = self.is_held = False
            self.engine.forget_result(self.number)
            self.engine.world.halt(self.number)

    def suspend(self, from_start: bool) -> bool:
        """Ask the world to stop it, to be started or asked again; a result that has come already stays."""
        if not self.is_asked:
            return False
        self.stop()
        self.statuses[self.number] = IDLE
        self.engine.cut_short.append(self.number)
        return from_start
