"""Leaves that request something of the robot, a skill or a service call, and wait for the response."""

from collections.abc import Mapping
from typing import ClassVar

from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, RUNNING, SUCCESS, Result

STOPPED = "it was stopped, and may not be started again"


class Leaf(Task):
    """Sends a request when it begins, and returns the result once it arrives; kinds implement `ask`."""

    __slots__ = ("is_asked", "is_held", "outcome", "status", "values")
    saved: ClassVar[tuple[str, ...]] = ("is_asked", "is_held", "outcome", "status", "values")
    claims = ""  # the part of the robot that the request needs exclusively
    is_restartable = True  # it may be requested again after it was stopped

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self.is_asked = False  # the request is under way, without a result so far
        self.is_held = False  # the world has paused it, to continue later
        self.status = IDLE
        self.outcome = ""
        self.values: Mapping[str, Value] = {}

    def proceed(self) -> int:
        """Return the result, once there is one; repeat a request that was stopped."""
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
        """Send the request and return the status; an exception is a failure of the node."""
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
        """Return the values of the result."""
        return dict(self.values)

    def halt(self) -> None:
        """Stop the request, for good."""
        super().halt()
        self.stop()

    def stop(self) -> None:
        """Stop the request, if one is under way."""
        if self.is_asked:
            self.is_asked = self.is_held = False
            self.engine.forget_result(self.number)
            self.engine.world.halt(self.number)

    def lose(self) -> None:
        """Repeat the request later, since nobody carries it out any more; fail if it must not be repeated."""
        if self.is_asked:
            self.is_asked = self.is_held = False
            if not self.is_restartable:
                self.status, self.engine.reasons[self.number] = FAILURE, STOPPED

    def suspend(self, from_start: bool) -> bool:
        """Stop the request, to be repeated later; keep a result that has already arrived.

        A pause stops only what needs a part of the robot: the rest goes on, and its result waits. What must not be
        repeated has then failed.
        """
        if not self.is_asked or not (from_start or self.claims):
            return False
        self.stop()
        if not from_start and not self.is_restartable:
            self.status, self.engine.reasons[self.number] = FAILURE, STOPPED
            return False
        self.statuses[self.number] = IDLE
        self.engine.cut_short.append(self.number)
        return from_start
