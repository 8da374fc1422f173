"""The engine runs one mission: single-threaded, pure, told the time, silent while nothing is to be done."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from rbxcompose.expressions.text import Template, fill
from rbxcompose.expressions.types import Type
from rbxcompose.expressions.values import EvaluationError, NotArrivedError, Value
from rbxcompose.missions import showing
from rbxcompose.missions.build import Builder
from rbxcompose.missions.course import Course, Reaction
from rbxcompose.missions.events import InterruptEnded, InterruptStarted, MissionEnded, MissionEvent, Reported
from rbxcompose.missions.program import ROOT, Program, RobotNames
from rbxcompose.missions.scopes import MissionScope, RunScope, Values
from rbxcompose.missions.statuses import FAILURE, IDLE, NAMES, RUNNING, SUCCESS
from rbxcompose.missions.task import NodeFailed, Task
from rbxcompose.missions.watching import Watched

TICKS_AT_ONCE = 100  # at one instant; then the mission is slowed down to its rate
ROUNDING = 1e-6  # [s] by which a deadline may seem to lie ahead when it has come


class World(Values, Protocol):
    """What a mission needs from outside: values, skills, someone who listens."""

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Start a skill for a leaf; `Engine.ended` tells how it ended."""
        ...

    def halt(self, leaf: int, /) -> None:
        """Stop the skill of a leaf; nothing is to be told of it any more."""
        ...

    def say(self, event: MissionEvent, /) -> None:
        """Hear what happens."""
        ...


class Engine:
    """Ticks the tasks of a program. `statuses` holds the status of each node by its number.

    At a tick, results that arrived come first, then the interrupts are looked at, then the course on top is ticked;
    that is done again at the same instant as long as something asks for it.
    """

    def __init__(self, program: Program, robot: RobotNames, inputs: Mapping[str, Value], world: World) -> None:
        self.program = program
        self.world = world
        self.places = robot.places
        self.statuses = [IDLE] * len(program.nodes)
        self.status = IDLE  # of the mission
        self.now = 0.0  # [s] of robot time
        self.time = 0.0  # [s] of the course that is being ticked: timers use it
        self.data: dict[str, Value] = {name: datum.value for name, datum in program.data.items()}
        self.because = ""  # why leaves are being halted
        self.cut_short: list[int] = []  # leaves that were halted by the latest suspension
        self.is_paused = False
        self._types: dict[str, Type] = {
            **robot.values,
            **{name: one.type for name, one in program.inputs.items()},
            **{name: datum.type for name, datum in program.data.items()},
        }
        self._scope = RunScope(self.data, inputs, robot.places, world)
        self._courses(program, robot)
        self._arrived: list[tuple[int, bool, str]] = []
        self._reasons: dict[int, str] = {}  # why a node failed the last time
        self._again: Task | Reaction | None = None  # who wants another tick at this instant
        self._instant = -1.0
        self._ticks = 0  # at this instant
        self._held_until: float | None = None  # slowed down until then [s]
        self._named: set[str] = set()  # loops that were reported for not waiting
        self._wake: float | None = None
        self._reads: set[str] = set()

    def _courses(self, program: Program, robot: RobotNames) -> None:
        builder = Builder(self, program, robot)
        self._mission = Course(len(program.interrupts))
        self._mission.root = builder.build(ROOT, self._scope)
        self._reactions: list[Reaction] = []
        for order, interrupt in enumerate(program.interrupts):
            reaction = Reaction(order, interrupt, self._scope)
            if interrupt.root is not None:
                reaction.root = builder.build(interrupt.root, self._scope)
            self._reactions.append(reaction)
        self._leaves = builder.leaves
        self._stack: list[Course] = [self._mission]  # what was cut short, and on top what runs
        self._returns: list[tuple[int, ...]] = []  # the leaves that each reaction of the stack halted

    # What the shell calls.

    def ended(self, leaf: int, success: bool, message: str = "") -> None:
        """Take the result of a skill; it counts from the next tick on."""
        self._arrived.append((leaf, success, message))

    def tick(self, now: float) -> int:
        """Do all that is to be done at `now` [s], and return the mission's status."""
        self.now = now
        if self.status not in (IDLE, RUNNING) or self.is_paused or self._is_held(now):
            return self.status
        if self.status == IDLE:
            self._begin()
        if now > self._instant:
            self._instant, self._ticks = now, 0
        while self.status == RUNNING:
            self._ticks += 1
            self._tick_once()
            if not (self._again or self._arrived):
                break
            if self._ticks >= TICKS_AT_ONCE:
                self._slow_down()
                break
        return self.status

    def next_wake(self) -> float | None:
        """Return when to tick next [s], unless something happens before; None: not by itself."""
        if self.status != RUNNING or self.is_paused:
            return None
        return self._wake if self._held_until is None else self._held_until

    def reads(self) -> frozenset[str]:
        """Return the names whose new values are worth a tick."""
        return frozenset(self._reads) if self.status == RUNNING and not self.is_paused else frozenset()

    def pause(self, now: float) -> None:
        """Halt what runs, and let all timers stand still until `resume`."""
        if self.status == RUNNING and not self.is_paused:
            self.now = now
            self._take_results()
            self.is_paused = True
            self._stack[-1].suspend(now, anew=False)

    def resume(self, now: float) -> None:
        """Go on; the skills that were halted are asked again at the next tick."""
        if self.is_paused:
            self.is_paused = False
            self._stack[-1].resume(now)

    def abort(self, now: float) -> None:
        """Halt what runs, for good."""
        if self.status == RUNNING:
            self.now = now
            self._take_results()
            self._halt_all()
            self.status = FAILURE
            self.world.say(MissionEnded("halted"))

    # What tasks call.

    def again(self, task: Task) -> None:
        """Ask for another tick at this instant."""
        self._again = task

    def is_due(self, deadline: float) -> bool:
        """Tell whether a time of this course [s] has come; if not, the engine wakes then."""
        ahead = deadline - self.time
        if ahead <= ROUNDING:
            return True
        self._wake_at(self.now + ahead)
        return False

    def watch(self, watched: Watched) -> None:
        """Wake when the condition may have changed."""
        self._reads |= watched.names
        if watched.is_polled:
            self._wake_at(self.now + 1 / self.program.rate)

    def halt(self, task: Task, because: str) -> None:
        """Halt what runs inside a task that fails, and keep the reason."""
        self._reasons[task.number] = self.because = because
        if task.current is not None:
            task.halt()
        self.because = ""

    def failed(self, task: Task, error: Exception) -> None:
        """Report why a task cannot go on."""
        message = _words(error)
        self._reasons[task.number] = message
        self.say(Reported(self.program.nodes[task.number].path, message))

    def forget_result(self, leaf: int) -> None:
        """Drop a result that has come for a leaf which is halted before it was taken."""
        self._arrived = [result for result in self._arrived if result[0] != leaf]

    def say(self, event: MissionEvent) -> None:
        """Tell the world what happens."""
        self.world.say(event)

    def show(self, name: str, value: Value) -> str:
        """Write the value of a name for people."""
        return showing.show_briefly(self._types.get(name), value)

    def filled(self, template: Template, scope: MissionScope) -> str:
        """Return a text with its values."""
        return fill(template, scope, self.show)

    # One tick.

    def _begin(self) -> None:
        self.status = RUNNING
        for reaction in self._reactions:
            reaction.scope.mark()

    def _tick_once(self) -> None:
        self._again = self._wake = None
        self._reads.clear()
        self._take_results()
        self._look()
        course = self._stack[-1]
        self.time = course.time(self.now)
        status = course.tick()
        if status == RUNNING:
            return
        if isinstance(course, Reaction) and status != FAILURE:
            self._go_back(course)
        else:
            self._finish(course, FAILURE if status == FAILURE else SUCCESS)

    def _take_results(self) -> None:
        arrived, self._arrived = self._arrived, []
        for leaf, success, message in arrived:
            task = self._leaves[leaf]
            if task.is_asked:
                if not success:
                    self._reasons[leaf] = message
                task.ended(SUCCESS if success else FAILURE, message)

    def _look(self) -> None:
        """Look at the interrupts: the first that holds, and may, cuts what runs."""
        highest = self._stack[-1].order
        chosen: Reaction | None = None
        for reaction in self._reactions:
            self.watch(reaction.watched)
            if not self._holds(reaction):
                reaction.is_armed = True
            elif reaction.is_armed and chosen is None and reaction.order < highest:
                chosen = reaction
        if chosen:
            self._cut(chosen)

    def _holds(self, reaction: Reaction) -> bool:
        try:
            holding, trouble = reaction.holds(), ""
        except Exception as error:  # a condition without a value does not hold
            holding, trouble = False, _words(error)
        if trouble and trouble != reaction.trouble:
            self.say(Reported(f"interrupts.{reaction.name}", trouble))
        reaction.trouble = trouble
        return holding

    def _cut(self, reaction: Reaction) -> None:
        reaction.is_armed = False
        condition = reaction.watched.condition
        robot_values = {one.name: self.world.value(one.name) for one in condition.names if self._is_robots(one.name)}
        shown = {name: self.show(name, value) for name, value in robot_values.items()}
        self.say(InterruptStarted(reaction.name, condition.text, shown))
        reaction.scope.mark()
        reaction.restart()
        self.cut_short = []
        self._stack[-1].suspend(self.now, anew=True)
        self._stack.append(reaction)
        self._returns.append(tuple(self.cut_short))

    def _is_robots(self, name: str) -> bool:
        return name not in self.data and name not in self.program.inputs

    def _go_back(self, reaction: Reaction) -> None:
        """Go on with what the reaction has cut short, after another look at the interrupts."""
        self._stack.pop()
        self._stack[-1].resume(self.now)
        self.say(InterruptEnded(reaction.name, self._returns.pop()))
        if not reaction.is_armed and self._holds(reaction):
            message = "its condition still holds after its reaction; it can act again once that has been false"
            self.say(Reported(f"interrupts.{reaction.name}", message))
        self._again = reaction

    def _finish(self, course: Course, status: int) -> None:
        self.status = status
        self._halt_all()
        message = self._why(course) if status == FAILURE else ""
        if isinstance(course, Reaction):
            message = f"the reaction of '{course.name}' failed: {message}"
        self.say(MissionEnded(NAMES[status], message))

    def _halt_all(self) -> None:
        for course in reversed(self._stack):
            course.halt()

    def _why(self, course: Course) -> str:
        """Return the path of the node that made a course fail, and its reason."""
        number = course.root.number if course.root else ROOT
        while number not in self._reasons:
            failed = [child for child in self.program.nodes[number].children if self.statuses[child] == FAILURE]
            if not failed:
                break
            number = failed[-1]
        path, reason = self.program.nodes[number].path, self._reasons.get(number)
        return f"{path}: {reason}" if reason else f"{path} failed"

    def _wake_at(self, at: float) -> None:
        if self._wake is None or at < self._wake:
            self._wake = at

    def _is_held(self, now: float) -> bool:
        if self._held_until is not None and self._held_until - now > ROUNDING:
            return True
        self._held_until = None
        return False

    def _slow_down(self) -> None:
        self._held_until = self.now + 1 / self.program.rate
        source = self._again
        if isinstance(source, Reaction):
            path = f"interrupts.{source.name}"
        else:
            path = self.program.nodes[source.number if source else ROOT].path
        if path not in self._named:
            self._named.add(path)
            self.say(Reported(path, f"does not wait: {TICKS_AT_ONCE} ticks at one instant, slowed down from now on"))


def _words(error: Exception) -> str:
    """Return an error in words for the robot's story."""
    if isinstance(error, EvaluationError | NotArrivedError | NodeFailed):
        return str(error)
    return f"{type(error).__name__}: {error}"
