"""Tasks, the running side of mission nodes, the runs and courses they are in, and the engine as they see it."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import reduce
from random import Random
from typing import Any, ClassVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate, holds
from rbxcompose.base.expressions.text import Show, Template, fill
from rbxcompose.base.expressions.tree import Expression, new_names
from rbxcompose.base.expressions.types import FLAG, UNKNOWN, Type
from rbxcompose.base.expressions.values import NOT_ARRIVED, Value
from rbxcompose.missions.engine.events import InterruptEnded, InterruptStarted, MissionEvent, Reported
from rbxcompose.missions.engine.world import (
    ItemScope,
    MissionScope,
    RunScope,
    Settings,
    SinceScope,
    Watched,
    World,
    item_types,
    show,
    show_briefly,
)
from rbxcompose.missions.language.grammar import DEEP
from rbxcompose.missions.program.outcomes import (
    FAILURE,
    IDLE,
    NAMES,
    RUNNING,
    SKIPPED,
    SUCCESS,
    NodeFailed,
    Result,
    words,
)
from rbxcompose.missions.program.parts import Asked
from rbxcompose.missions.program.program import (
    CONTINUE,
    END,
    NOTHING,
    Interrupt,
    MissionNode,
    Program,
    RobotNames,
    Target,
)


class ResumePoints:
    """The tasks that will resume where they were halted.

    A task keeps its place if it has a history, or if a task around it with a `deep` history is being halted.
    """

    def __init__(self) -> None:
        self.kept: set[Task] = set()
        self.is_deep = False

    def leave(self, task: Task) -> None:
        """Note that a task is being halted."""
        if self.is_deep:
            self.kept.add(task)

    def take_up(self, task: Task) -> bool:
        """Return whether a task that starts has a place to resume at, and forget that place."""
        if task in self.kept:
            self.kept.remove(task)
            return True
        return False

    def forget(self, first: int, end: int) -> None:
        """Forget the places of all nodes from number `first` to `end` (exclusive)."""
        if self.kept:
            self.kept = {task for task in self.kept if not first <= task.number < end}


ROUNDING = 1e-6  # [s] tolerance with which a deadline counts as reached


@dataclass(slots=True)
class NodeProbe:
    """Where a debugger stops the mission at a node, and what has come of that; a node without one never asks.

    `ends` are the transitions of a state that stop it, by the outcomes under which they are written. A step stops at
    the start of a leaf (`steps_in`) and at any transition of a state (`steps_out`). `is_waiting` is a node that was to
    start and has not begun. `result` is the status and the outcome with which a node will end at its next tick.
    """

    starts: bool = False
    ends: frozenset[str] = NOTHING
    steps_in: bool = False
    steps_out: bool = False
    only_first: bool = False  # a condition that a reactive list evaluates again and again
    is_waiting: bool = False
    result: tuple[int, str] | None = None

    @property
    def is_pending(self) -> bool:
        """Return whether the node only seems to run: it has not begun, or has ended."""
        return self.is_waiting or self.result is not None

    @property
    def is_needed(self) -> bool:
        """Return whether the node must still be observed."""
        return self.starts or bool(self.ends) or self.steps_in or self.steps_out or self.is_pending


def result_word(status: int) -> str:
    """Return the result that a status counts as for the transitions of a state."""
    return NAMES[SUCCESS if status == SKIPPED else status]


class EngineBase:
    """The state of an engine, and what tasks do with it. `statuses` holds the status of each node by its number."""

    def __init__(self, program: Program, robot: RobotNames, world: World, settings: Settings) -> None:
        self.program = program
        self.world = world
        self.robot = robot
        self.settings = settings
        self.statuses = [IDLE] * len(program.nodes)
        self.outcome = ""  # the own outcome of the node that ended last; empty if it has none
        self.now = 0.0  # [s] of robot time
        self.time = 0.0  # [s] on the clock of the course being ticked; timers use it
        self.lost = 0.0  # [s] for which the mission was paused; during a pause, minus the time at which it began
        self.because = ""  # why leaves are being halted
        self.cut_short: list[int] = []  # leaves that were halted by the latest suspension
        self.restarting: tuple[Target, ...] = ()  # what starts again after the current suspension
        self.is_aborting = False  # the whole mission is being ended from outside
        self.places = ResumePoints()
        self.reasons: dict[int, str] = {}  # why each node last failed
        self.draws = 0  # random draws so far
        self.work = 0  # how often an observed node was started or continued so far
        self.arrived: list[tuple[int, Result]] = []
        self.wake: float | None = None
        self.reading: set[str] = set()
        self.probes: dict[int, NodeProbe] = {}  # breakpoints and what follows from them, by node number
        self.stops: list[int] = []  # nodes at which probes stopped the mission; the shell then pauses it
        self.wants_again: Task | Reaction | None = None  # what requested another tick at this instant

    @property
    def unpaused(self) -> float:
        """Return robot time without the pauses of the mission [s]; unlike `time`, it continues during interrupts."""
        return self.now - self.lost

    def again(self, by: Task | Reaction) -> None:
        """Request another tick at this instant."""
        self.wants_again = by

    def is_past(self, time: float) -> bool:
        """Return whether a time on the clock of this course [s] has been reached."""
        return time - self.time <= ROUNDING

    def has_gone_by(self, seconds: float, since: float) -> bool:
        """Return whether this many seconds have passed since a time of `unpaused`."""
        return seconds - (self.unpaused - since) <= ROUNDING

    def chance(self) -> Random:
        """Return a random source for one draw, which depends only on the seed and the number of earlier draws."""
        self.draws += 1
        return Random(f"{self.settings.seed}/{self.draws}")  # noqa: S311 - no secret, and must be repeatable

    def is_due(self, deadline: float) -> bool:
        """Return whether a deadline on the clock of this course [s] has been reached; if not, wake then."""
        if self.is_past(deadline):
            return True
        self.wake_at(deadline + (self.now - self.time))
        return False

    def watch(self, watched: Watched) -> None:
        """Wake when the condition may have changed."""
        self.reading |= watched.names
        if watched.is_polled:
            self.wake_at(self.now + 1 / self.program.rate)

    def wake_at(self, at: float) -> None:
        """Wake at a robot time [s], unless something is due before."""
        if self.wake is None or at < self.wake:
            self.wake = at

    def forget_result(self, leaf: int) -> None:
        """Drop the result of a leaf that is halted before the result was taken."""
        self.arrived = [result for result in self.arrived if result[0] != leaf]

    def say(self, event: MissionEvent) -> None:
        """Report an event to the world."""
        self.world.say(event)


@dataclass(frozen=True, slots=True)
class Site:
    """What a task is made from: the engine, the run of its mission, its node, its scope, the tasks below it.

    `item` is the scope that a loop adds for the tasks below it; `inner` is the run of the mission that a `use` runs.
    """

    engine: EngineBase
    run: Run
    node: MissionNode
    scope: MissionScope
    children: tuple[Task, ...] = ()
    item: ItemScope | None = None
    inner: Run | None = None


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
        if self.end - self.number > 1 and self not in self.engine.places.kept:
            self.forget()
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

    def request(self, send: Callable[[], None]) -> int:
        """Send a request; if that raises, none is under way."""
        self.status, self.is_asked = RUNNING, True
        try:
            send()
        except (Exception, SystemExit):
            self.is_asked = False
            raise
        return RUNNING

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


def since_scope(outer: MissionScope, asked: Sequence[Asked], robot: RobotNames, program: Program) -> SinceScope:
    """Return the scope of what asks for these; a flag that is an event is false until it comes."""
    names = frozenset[str]().union(*(new_names(item.expression) for item in asked))
    read = {name.name for item in asked if item.is_watched for name in item.expression.names}
    events = (read & robot.events) - {*program.data, *program.inputs}
    return SinceScope(outer, names, {name: False if robot.values[name] == FLAG else NOT_ARRIVED for name in events})


_STEPS = re.compile(r"""[^]['".]+""")  # of a path such as `result.names[0]`
STILL_HOLDS = "its condition still holds after its reaction; it can act again once that has been false"


class Run:
    """Runs a whole mission, or one that another uses; the times it is given are then those of its caller.

    A tick checks the interrupts, then ticks the course on top. `begun` counts its starts.
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
        self.types: dict[str, Type] = {
            **robot.values,
            **{name: input_.type for name, input_ in program.inputs.items()},
            **{name: datum.type for name, datum in program.data.items()},
        }
        self.failed: Course | None = None  # the one that made it fail
        self.mission = Course(len(program.interrupts))
        self.reactions = [
            Reaction(order, interrupt, since_scope(self.scope, (interrupt.when,), robot, program))
            for order, interrupt in enumerate(program.interrupts)
        ]
        self.stack: list[Course] = [self.mission]  # suspended courses, with the running one on top
        self.returns: list[tuple[int, ...]] = []  # the leaves that each reaction of the stack halted
        self.keepers: list[Task] = []  # the tasks of the main node that can keep a place

    def show(self, name: str, value: Value) -> str:
        """Return the value of a name as text for people."""
        return show_briefly(self.types.get(name), value)

    def filled(self, template: Template, scope: MissionScope) -> str:
        """Return a text for people with its values filled in; names of places lose their underscores."""
        return fill(template, scope, self._shown(scope, self.engine.robot.places))

    def written(self, template: Template, scope: MissionScope) -> str:
        """Return a text for programs with its values filled in; texts among these stay as they are."""
        return fill(template, scope, self._shown(scope))

    def _shown(self, scope: MissionScope, places: Collection[str] = ()) -> Show:
        types = ChainMap(item_types(scope), self.types)

        def shown(path: str, value: Value) -> str:
            name, *fields = _STEPS.findall(path)
            found = reduce(Type.part, fields, types.get(name, UNKNOWN))
            return show(found, value, briefly=True, places=places)

        return shown

    @property
    def courses(self) -> tuple[Course, ...]:
        """Return the mission proper and its reactions."""
        return (self.mission, *self.reactions)

    def begin(self, inputs: Mapping[str, Value]) -> None:
        """Start afresh: initial data, nothing runs, every interrupt is armed."""
        self.inputs.clear()
        self.inputs.update(inputs)
        self.data.clear()
        self.data.update(dict.fromkeys(self.program.saved, NOT_ARRIVED))
        self.data.update((name, datum.value) for name, datum in self.program.data.items())
        self.begun += 1
        self.ending, self.message, self.failed = None, "", None
        self.begin_again()

    def begin_again(self) -> None:
        """Start again with the current data; nodes that keep their place resume there."""
        self.stack[:], self.returns[:] = [self.mission], []
        for course in self.courses:
            course.restart()
        for reaction in self.reactions:
            reaction.is_armed = True
            reaction.scope.mark()

    def tick(self, now: float) -> int:
        """Check the interrupts, then continue with the course on top; return the status of the mission."""
        self._look(now)
        course, outer = self.stack[-1], self.engine.time
        self.engine.time = course.time(now)
        status = course.tick()
        self.engine.time = outer
        if self.ending is not None or course is not self.mission:
            self.engine.outcome = ""  # only the mission proper may end with an outcome of its own
        if self.ending is not None:
            return self._finish(course, self.ending)
        if status == RUNNING:
            return RUNNING
        if isinstance(course, Reaction) and status != FAILURE:
            return self._go_on(course, now)
        return self._finish(course, status)

    def halt(self) -> None:
        """Stop what runs, for good."""
        for course in reversed(self.stack):
            course.halt()
        self.stack[:], self.returns[:] = [self.mission], []

    def suspend(self, from_start: bool) -> None:
        """Stop the running leaves, and keep the place."""
        self.stack[-1].cut(from_start)

    def _look(self, now: float) -> None:
        """Check the interrupts: the first that holds and may act suspends what runs."""
        highest = self.stack[-1].order
        chosen: Reaction | None = None
        for reaction in self.reactions:
            self.engine.watch(reaction.watched)
            if not self._holds(reaction):
                reaction.is_armed = True
            elif reaction.is_armed and chosen is None and reaction.order < highest:
                chosen = reaction
        if chosen:
            self._cut(chosen, now)

    def _holds(self, reaction: Reaction) -> bool:
        try:
            holding, trouble = reaction.holds(), ""
        except Exception as error:  # a condition without a value does not hold
            holding, trouble = False, words(error)
        if trouble and trouble != reaction.trouble:
            self.engine.say(Reported(reaction.place, trouble))
        reaction.trouble = trouble
        return holding

    def _cut(self, reaction: Reaction, now: float) -> None:
        reaction.is_armed = False
        condition, world = reaction.watched.condition, self.engine.world
        robot_values = {
            reference.name: world.value(reference.name)
            for reference in condition.names
            if reference.name not in self.data and reference.name not in self.inputs
        }
        shown = {name: self.show(name, value) for name, value in robot_values.items()}
        self.engine.say(InterruptStarted(reaction.name, condition.text, shown))
        reaction.scope.mark()
        reaction.restart()
        self.engine.cut_short = []
        self.engine.restarting = reaction.targets
        self.stack[-1].suspend(now, from_start=True)
        self.engine.restarting = ()
        self.stack.append(reaction)
        self.returns.append(tuple(self.engine.cut_short))

    def _go_on(self, reaction: Reaction, now: float) -> int:
        """Do what follows a reaction; suspended work continues after the interrupts are checked again."""
        if reaction.afterwards == END:
            return self._finish(self.mission, SUCCESS)
        self.stack.pop()
        back, afterwards, restarted = self.returns.pop(), reaction.afterwards, ""
        if afterwards == CONTINUE or reaction.targets:
            self.stack[-1].resume(now)
            if self._start_over(reaction.targets):
                restarted = reaction.restarts
            else:
                afterwards = CONTINUE
        else:
            self.halt()
            for root in (
                self.program.main,
                *(interrupt.root for interrupt in self.program.interrupts if interrupt.root is not None),
            ):
                self.engine.places.forget(root, self.engine.program.nodes[root].end)
            self.begin(dict(self.inputs))
            reaction.is_armed = False
        self.engine.say(InterruptEnded(reaction.name, afterwards, back, restarted))
        if not reaction.is_armed and self._holds(reaction):
            self.engine.say(Reported(reaction.place, STILL_HOLDS))
        self.engine.again(reaction)
        return RUNNING

    def _start_over(self, targets: tuple[Target, ...]) -> bool:
        """Restart the targets wherever they run; return whether any of them runs."""
        has_begun = False
        for target in targets:
            for course in self.stack:
                if course.start_over(target):
                    has_begun = True
                    if not target.is_round:
                        self._forget_place_of(target.number)
        return has_begun

    def _forget_place_of(self, number: int) -> None:
        """Forget the place of a node that restarts; nodes inside it keep the places of their own histories."""
        node = self.engine.program.nodes[number]
        is_deep = node.step.history == DEEP
        self.engine.places.forget(number, node.end if is_deep else number + 1)

    def _finish(self, course: Course, status: int) -> int:
        self.halt()
        self.failed = course if status == FAILURE else None
        return FAILURE if status == FAILURE else SUCCESS
