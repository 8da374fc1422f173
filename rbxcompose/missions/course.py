"""A course is one line of work with a clock of its own: the mission itself, or the reaction to an interrupt."""

from __future__ import annotations

from rbxcompose.expressions.evaluate import holds
from rbxcompose.missions.program import Interrupt
from rbxcompose.missions.scopes import MissionScope, SinceScope, new_names
from rbxcompose.missions.statuses import RUNNING, SUCCESS
from rbxcompose.missions.task import Task
from rbxcompose.missions.watching import Watched


class Course:
    """Work under one root. Its time stands still while it is suspended, so that its timers go on with the rest.

    `order` tells who may cut whom: a smaller one cuts a larger one.
    """

    def __init__(self, order: int) -> None:
        self.order = order
        self.root: Task | None = None
        self.current: Task | None = None  # the root while it runs
        self._lost = 0.0  # [s] for which the time stood still
        self._left: float | None = None  # when it was suspended [s]

    def time(self, now: float) -> float:
        """Return the time of this course [s]."""
        return now - self._lost

    def tick(self) -> int:
        """Start the root or go on with it; a reaction without a root is done at once."""
        root = self.root
        if root is None:
            return SUCCESS
        status = root.start() if self.current is None else root.tick()
        self.current = root if status == RUNNING else None
        return status

    def suspend(self, now: float, anew: bool) -> None:
        """Stop what runs, keep the place and stop the clock."""
        self._left = now
        if self.current is not None and self.current.suspend(anew):
            self.current = None

    def resume(self, now: float) -> None:
        """Let the clock go on."""
        if self._left is not None:
            self._lost += now - self._left
            self._left = None

    def restart(self) -> None:
        """Forget an earlier run."""
        self.current = None
        self._lost, self._left = 0.0, None

    def halt(self) -> None:
        """Stop what runs, for good."""
        if self.current is not None:
            current, self.current = self.current, None
            current.halt()


class Reaction(Course):
    """An interrupt: its condition and its course."""

    def __init__(self, order: int, definition: Interrupt, scope: MissionScope) -> None:
        super().__init__(order)
        self.name = definition.name
        self.watched = Watched.of(definition.when.expression)
        self.scope = SinceScope(scope, new_names(definition.when.expression))
        self.is_armed = True  # it may act: its condition was false since it last did
        self.trouble = ""  # why the condition had no value when it was last asked

    def holds(self) -> bool:
        """Ask the condition; raises what an expression may raise."""
        return holds(self.watched.condition, self.scope)
