"""A course is one line of work with a clock of its own: the mission itself, or the reaction to an interrupt."""

from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.missions.engine.task import Task
from rbxcompose.missions.engine.world import SinceScope, Watched
from rbxcompose.missions.program.outcomes import RUNNING, SUCCESS
from rbxcompose.missions.program.program import Interrupt, Target


class Course:
    """Work under one root. Its clock stops while it is suspended, so that its timers later continue with the time left.

    `order` is a priority: a course may suspend those with a larger order.
    """

    def __init__(self, order: int) -> None:
        self.order = order
        self.root: Task | None = None
        self.current: Task | None = None  # the root while it runs
        self.lost = 0.0  # [s] for which the time stood still
        self.left: float | None = None  # when it was suspended [s]

    def time(self, now: float) -> float:
        """Return the time of this course [s]."""
        return now - self.lost

    def tick(self) -> int:
        """Start the root or continue with it; a reaction without a root ends immediately."""
        root = self.root
        if root is None:
            return SUCCESS
        status = root.start() if self.current is None else root.tick()
        self.current = root if status == RUNNING else None
        return status

    def suspend(self, now: float, from_start: bool) -> None:
        """Stop what runs, keep its place and stop the clock."""
        self.left = now
        self.cut(from_start)

    def cut(self, from_start: bool) -> None:
        """Stop what runs and keep its place; stopping the clock is left to the caller."""
        if self.current is not None and self.current.suspend(from_start):
            self.current = None

    def resume(self, now: float) -> None:
        """Let the clock continue."""
        if self.left is not None:
            self.lost += now - self.left
            self.left = None

    def start_over(self, target: Target) -> bool:
        """Restart the target if it runs here; return whether it does."""
        current = self.current
        if current is None:
            return False
        if current.number == target.number and not target.is_round:
            self.halt()
            return True
        return current.restart(target)

    def restart(self) -> None:
        """Reset after an earlier run."""
        self.current = None
        self.lost, self.left = 0.0, None

    def halt(self) -> None:
        """Stop what runs, for good."""
        if self.current is not None:
            current, self.current = self.current, None
            current.halt()


class Reaction(Course):
    """An interrupt: its condition, its course, and what comes afterwards."""

    def __init__(self, order: int, definition: Interrupt, scope: SinceScope) -> None:
        super().__init__(order)
        self.name, self.place = definition.name, definition.span.place
        self.afterwards = definition.afterwards
        self.targets = definition.targets
        self.restarts = definition.restarts.text if definition.restarts else ""  # the name of the targets
        self.watched = Watched.of(definition.when.expression)
        self.scope = scope
        self.is_armed = True  # it may act: its condition has been false since it last acted
        self.trouble = ""  # why the condition had no value when it was last evaluated

    def holds(self) -> bool:
        """Return whether the condition holds; raises what an expression may raise."""
        return holds(self.watched.condition, self.scope)
