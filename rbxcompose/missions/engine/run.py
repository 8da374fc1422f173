"""One run of one mission: its data, its interrupts, and its courses: what runs and what is suspended."""

from collections.abc import Mapping, Sequence

from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.base.expressions.tree import new_names
from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.expressions.values import NOT_ARRIVED, Value
from rbxcompose.missions.engine.events import InterruptEnded, InterruptStarted, Reported
from rbxcompose.missions.engine.task import EngineBase, RunBase, Task
from rbxcompose.missions.engine.world import MissionScope, SinceScope, Watched
from rbxcompose.missions.language.grammar import DEEP
from rbxcompose.missions.program.families import WithHistory
from rbxcompose.missions.program.outcomes import FAILURE, RUNNING, SUCCESS, words
from rbxcompose.missions.program.parts import Asked
from rbxcompose.missions.program.program import CONTINUE, END, Interrupt, Program, RobotNames, Target


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


STILL_HOLDS = "its condition still holds after its reaction; it can act again once that has been false"


class Run(RunBase):
    """Runs a whole mission, or one that another uses; the times it is given are then those of its caller.

    A tick checks the interrupts, then ticks the course on top.
    """

    def __init__(self, engine: EngineBase, program: Program, robot: RobotNames) -> None:
        super().__init__(engine, program, robot)
        self.failed: Course | None = None  # the one that made it fail
        self.mission = Course(len(program.interrupts))
        self.reactions = [
            Reaction(order, interrupt, since_scope(self.scope, (interrupt.when,), robot, program))
            for order, interrupt in enumerate(program.interrupts)
        ]
        self.stack: list[Course] = [self.mission]  # suspended courses, with the running one on top
        self.returns: list[tuple[int, ...]] = []  # the leaves that each reaction of the stack halted
        self.keepers: list[WithHistory] = []  # the tasks of the main node that can keep a place

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

    def main_tasks(self) -> list[WithHistory]:
        """Return the tasks of the main node that can keep a place."""
        return self.keepers

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
