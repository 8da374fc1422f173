"""A task is the running side of a mission node: started, ticked while it runs, halted or suspended from above."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.engine.engine_base import EngineBase, RunBase
from rbxcompose.missions.engine.events import Reported
from rbxcompose.missions.engine.scopes import ItemScope, MissionScope
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, RUNNING, NodeFailed, words
from rbxcompose.missions.program.program import MissionNode, Target


@dataclass(frozen=True, slots=True)
class Site:
    """What a task is made from: the engine, the run of its mission, its node, its scope, the tasks below it.

    `item` is the scope that a loop adds for the tasks below it; `inner` is the run of the mission that a `use` runs.
    """

    engine: EngineBase
    run: RunBase
    node: MissionNode
    scope: MissionScope
    children: tuple[Task, ...] = ()
    item: ItemScope | None = None
    inner: RunBase | None = None


class MovedChildren:
    """Where the children of a node are after a change of the mission that runs.

    `count` is how many there are now, `restarted` are the indexes now of those that run and begin again.
    """

    def __init__(self, moved: Mapping[int, int], before: int, count: int, restarted: frozenset[int]) -> None:
        """Take the index now of each child that is still there, and how many there were `before`."""
        self.count, self.restarted = count, restarted
        self._before = before
        self.is_astray = False
        """Whether a place was looked for that is gone."""
        self._moved = moved

    def to(self, index: int) -> int:
        """Return the index now of a child that had this index; what was no child stays none."""
        if not 0 <= index < self._before:
            return index
        self.is_astray = self.is_astray or index not in self._moved
        return self._moved.get(index, 0)

    def kept(self, indexes: Iterable[int]) -> list[int]:
        """Return the indexes now of those children that are still there."""
        return [self._moved[index] for index in indexes if index in self._moved]


class Task(ABC):
    """The running side of a node; kinds implement `begin` and, if they take time, `proceed`.

    `current` is the task below that runs now. A task without one continues by starting the child that it was at, so
    that a child suspended for a restart needs no further bookkeeping. `saved` names the other attributes that make up
    its state.
    """

    __slots__ = ("current", "end", "engine", "number", "run", "scope", "statuses")
    saved: ClassVar[tuple[str, ...]] = ()
    times: ClassVar[tuple[str, ...]] = ()  # those of `saved` that are times [s]
    fresh: ClassVar[tuple[str, ...]] = ()  # those without a meaning until the next start computes them
    reported: ClassVar[tuple[str, ...]] = ()  # those that affect only what is reported

    def __init__(self, site: Site) -> None:
        self.engine = site.engine
        self.run = site.run
        self.number = site.node.number
        self.end = site.node.end
        self.scope = site.scope
        self.statuses = site.engine.statuses
        self.current: Task | None = None

    def start(self) -> int:
        """Begin, and return the status after the first tick."""
        if self.engine.reasons:
            self.engine.reasons.pop(self.number, None)  # of an earlier run
        try:
            status = self.begin()
        except (Exception, SystemExit) as error:  # whatever a leaf does wrong ends its node, not the engine
            status = self._broken(error)
        self.statuses[self.number] = status
        return status

    def tick(self) -> int:
        """Continue, and return the status; only for a task that runs."""
        try:
            status = self.proceed()
        except (Exception, SystemExit) as error:
            status = self._broken(error)
        self.statuses[self.number] = status
        return status

    def halt(self) -> None:
        """Stop what runs here and below; only for a task that runs."""
        self.statuses[self.number] = IDLE
        self.engine.places.leave(self)
        self.halt_below()

    def halt_below(self) -> None:
        """Stop what runs below."""
        child = self.current
        if child is not None:
            self.current = None
            child.halt()

    def suspend(self, from_start: bool) -> bool:
        """Stop the running leaves, keep the place, and return whether this task must be started again.

        With `from_start`, a leaf and its modifiers begin again, as after an interrupt; without it, as after
        a pause, a leaf repeats only what it asked of the robot.
        """
        child = self.current
        if child is not None and child.suspend(from_start):
            self.current = None
        return False

    def restart(self, target: Target) -> bool:
        """Restart the target if it runs below; return whether it does."""
        child = self.current
        if child is None:
            return False
        if child.number == target.number and not target.is_round and self.number != target.number:
            self.current = None
            child.halt()
            return True
        return child.restart(target)

    def running(self) -> tuple[Task, ...]:
        """Return the tasks below that run now."""
        return () if self.current is None else (self.current,)

    def jump(self, state: str) -> None:
        """Leave the state that runs, and enter this one at the next tick; only a machine can."""
        raise NotImplementedError(f"{type(self).__name__} has no states")

    def adapted(self, state: dict[str, Any], children: MovedChildren) -> dict[str, Any]:
        """Return the state that this task takes over from the same node before a change: its `saved` attributes."""
        return {**state, "index": children.to(state["index"])} if "index" in state else state

    def restored(self) -> None:  # noqa: B027 - most kinds have nothing to do
        """Recompute what follows from the state, after it was restored."""

    def only_failed(self) -> bool | None:
        """Return whether it is a step that may fail and failed each time; None if that means nothing here."""
        return None

    def result(self) -> Value:
        """Return what `save` keeps of this node."""
        return None

    @abstractmethod
    def begin(self) -> int:
        """Do the first tick."""

    def proceed(self) -> int:
        """Do one more tick."""
        raise NotImplementedError(f"{type(self).__name__} ends with its first tick")

    def advance(self, child: Task) -> int:
        """Start the child or continue with it, and return its status."""
        status = child.start() if self.current is None else child.tick()
        self.current = child if status == RUNNING else None
        return status

    def forget(self) -> None:
        """Set the statuses of the nodes below to idle, before they run once more."""
        first = self.number + 1
        self.statuses[first : self.end] = [IDLE] * (self.end - first)

    def number_of(self, expression: Expression, what: str) -> float:
        """Return the value of an expression that must be a number, at least 0.

        Raises:
            NodeFailed: if it is not.
        """
        value = evaluate(expression, self.scope)
        if isinstance(value, bool) or not isinstance(value, int | float) or value < 0:
            raise NodeFailed(f"{what} must be a number, at least 0, not {self.run.show('', value)}")
        return value

    def count_of(self, expression: Expression, what: str) -> int:
        """Return the value of an expression that must be a whole number, at least 0.

        Raises:
            NodeFailed: if it is not.
        """
        value = self.number_of(expression, what)
        if value != int(value):
            raise NodeFailed(f"{what} must be a whole number, not {self.run.show('', value)}")
        return int(value)

    @property
    def place(self) -> str:
        """Return its file and line."""
        return self.engine.program.nodes[self.number].span.place

    def cut(self, because: str) -> None:
        """Stop what runs below, since this task fails, and keep the reason."""
        engine = self.engine
        engine.reasons[self.number] = engine.because = because
        self.halt_below()
        engine.because = engine.outcome = ""

    def report(self, error: BaseException) -> None:
        """Report why this task cannot continue."""
        message = words(error)
        self.engine.reasons[self.number] = message
        self.engine.say(Reported(self.place, message))

    def _broken(self, error: BaseException) -> int:
        self.halt_below()
        self.engine.places.forget(self.number, self.end)
        self.engine.outcome = ""
        self.report(error)
        return FAILURE
