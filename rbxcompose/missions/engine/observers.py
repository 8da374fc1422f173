"""Tasks around a node that change nothing: they count messages since its start, report its name, notify an observer."""

from __future__ import annotations

from rbxcompose.missions.engine.events import BranchEnded, NodeEnded, NodeStarted
from rbxcompose.missions.engine.scopes import SinceScope
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.engine.world import Observer
from rbxcompose.missions.modifiers.registry import Decorator
from rbxcompose.missions.program.look import Form
from rbxcompose.missions.program.statuses import IDLE, NAMES, RUNNING


class Since(Decorator):
    """Counts messages from the start of a node that uses `new($x)`."""

    __slots__ = ("view",)
    saved = ("seen",)

    def __init__(self, site: Site, options: SinceScope, inner: Task) -> None:
        super().__init__(site, inner)
        self.view = options

    @property
    def seen(self) -> dict[str, int]:
        """Return how many messages of each name had arrived when it started."""
        return self.view.seen

    @seen.setter
    def seen(self, seen: dict[str, int]) -> None:
        self.view.seen = seen

    def begin(self) -> int:
        """Count from now on."""
        self.view.mark()
        return self.advance(self.inner)


class Around(Decorator):
    """A task notified when its node starts, ends or is halted; a restart after an interrupt counts as halted."""

    __slots__ = ()

    def begin(self) -> int:
        """Report that it starts."""
        self.started()
        return self.proceed()

    def proceed(self) -> int:
        """Continue, and report if it ends."""
        status = self.advance(self.inner)
        if status != RUNNING:
            self.ended(status)
        return status

    def halt(self) -> None:
        """Report that it is halted."""
        super().halt()
        self.ended(IDLE)

    def suspend(self, from_start: bool) -> bool:
        """Report that it is halted, if it starts again."""
        starts_over = super().suspend(from_start)
        if starts_over:
            self.ended(IDLE)
        return starts_over

    def started(self) -> None:
        """Handle the start of the node."""
        raise NotImplementedError

    def ended(self, status: int) -> None:
        """Handle the end of the node; IDLE means that it was halted."""
        raise NotImplementedError

    def how(self, status: int) -> str:
        """Return the word for how the node ended: its own outcome, if it has one, else its status."""
        return "halted" if status == IDLE else self.engine.outcome or NAMES[status]


class NamedObserver(Around):
    """Reports when a named node or a state starts and ends."""

    __slots__ = ("is_state", "name")

    def __init__(self, site: Site, options: str, inner: Task) -> None:
        super().__init__(site, inner)
        self.name = options
        self.is_state = site.node.step.look.form is Form.STATE

    def started(self) -> None:
        """Report it."""
        self.engine.say(NodeStarted(self.number, self.name, self.is_state))

    def ended(self, status: int) -> None:
        """Report it."""
        self.engine.say(NodeEnded(self.number, self.name, self.how(status), self.is_state))


class Branch(Around):
    """Reports when a branch of a parallel ends; its start shows in what it does first."""

    __slots__ = ("name",)

    def __init__(self, site: Site, options: str, inner: Task) -> None:
        super().__init__(site, inner)
        self.name = options

    def started(self) -> None:
        """Report nothing."""

    def ended(self, status: int) -> None:
        """Report it."""
        self.engine.say(BranchEnded(self.number, self.name, self.how(status)))


class Observed(Around):
    """Notifies an observer, and counts the work: whoever runs an engine with an observer can limit it."""

    __slots__ = ("observer",)

    def __init__(self, site: Site, options: Observer, inner: Task) -> None:
        super().__init__(site, inner)
        self.observer = options

    def proceed(self) -> int:
        """Count it, and continue."""
        self.engine.work += 1
        return super().proceed()

    def started(self) -> None:
        """Report it."""
        self.observer.started(self.number)

    def ended(self, status: int) -> None:
        """Report it."""
        self.observer.ended(self.number, status, self.engine.outcome)
