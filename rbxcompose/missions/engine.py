"""The engine runs one mission: single-threaded, pure, told the time, silent while nothing is to be done."""

from __future__ import annotations

from collections.abc import Mapping
from random import Random

from rbxcompose.expressions.values import Value
from rbxcompose.missions.build import Builder
from rbxcompose.missions.course import Reaction
from rbxcompose.missions.events import MissionEnded, MissionEvent, Reported
from rbxcompose.missions.kinds.parallel import ParallelOptions
from rbxcompose.missions.linking import link
from rbxcompose.missions.places import Places
from rbxcompose.missions.program import Program, RobotNames, Target
from rbxcompose.missions.results import Result
from rbxcompose.missions.run import words
from rbxcompose.missions.statuses import FAILURE, IDLE, NAMES, RUNNING, SUCCESS
from rbxcompose.missions.task import Task
from rbxcompose.missions.watching import Watched
from rbxcompose.missions.world import PLAIN, Settings, World

TICKS_AT_ONCE = 100  # at one instant; then the mission is slowed down to its rate
ROUNDING = 1e-6  # [s] by which a deadline may seem to lie ahead when it has come


class Engine:
    """Ticks the tasks of a program. `statuses` holds the status of each node by its number.

    `program` is linked: the missions that it uses are part of it, each as often as it is used. At a tick, results that
    arrived come first, then the interrupts are looked at, then what is on top is ticked; that is done again at the
    same instant as long as something asks for it.
    """

    def __init__(
        self, program: Program, robot: RobotNames, inputs: Mapping[str, Value], world: World, settings: Settings = PLAIN
    ) -> None:
        self.program = link(program, robot.missions)
        self.world = world
        self.robot = robot
        self.settings = settings
        self.statuses = [IDLE] * len(self.program.nodes)
        self.status = IDLE  # of the mission
        self.outcome = ""  # with which the node that ended last did so; empty for the plain one
        self.now = 0.0  # [s] of robot time
        self.time = 0.0  # [s] of the course that is being ticked: timers use it
        self.lost = 0.0  # [s] for which the mission was paused; while it is, less the time at which that began
        self.because = ""  # why leaves are being halted
        self.cut_short: list[int] = []  # leaves that were halted by the latest suspension
        self.restarting: tuple[Target, ...] = ()  # what begins anew after the suspension that is going on
        self.is_paused = False
        self.is_aborting = False  # the mission as a whole is ended from outside
        self.places = Places()
        self.reasons: dict[int, str] = {}  # why a node failed the last time
        self.draws = 0  # of chance so far
        builder = Builder(self, robot)
        self.main = builder.run(self.program)
        self.tasks, self.runs, self._leaves = builder.tasks, builder.runs, builder.leaves
        self._indexes = {task: index for index, task in enumerate(self.tasks)}
        self._inputs = dict(inputs)
        self.arrived: list[tuple[int, Result]] = []
        self._again: Task | Reaction | None = None  # who wants another tick at this instant
        self.instant = -1.0
        self.ticks = 0  # at this instant
        self.held_until: float | None = None  # slowed down until then [s]
        self.named: set[str] = set()  # loops that were reported for not waiting
        self.wake: float | None = None
        self.reading: set[str] = set()

    # What the shell calls.

    @property
    def data(self) -> Mapping[str, Value]:
        """Return the data of the mission, by name."""
        return self.main.data

    def ended(self, leaf: int, result: Result) -> None:
        """Take the result of a skill or a call; it counts from the next tick on."""
        self.arrived.append((leaf, result))

    def tick(self, now: float) -> int:
        """Do all that is to be done at `now` [s], and return the mission's status."""
        self.now = now
        if self.status not in (IDLE, RUNNING) or self.is_paused or self._is_held(now):
            return self.status
        if self.status == IDLE:
            self.status = RUNNING
            self.main.begin(self._inputs)
        if now > self.instant:
            self.instant, self.ticks = now, 0
        while self.status == RUNNING:
            self.ticks += 1
            self._tick_once()
            if not (self._again or self.arrived):
                break
            if self.ticks >= TICKS_AT_ONCE:
                self._slow_down()
                break
        return self.status

    def next_wake(self) -> float | None:
        """Return when to tick next [s], unless something happens before; None: not by itself."""
        if self.status != RUNNING or self.is_paused:
            return None
        return self.wake if self.held_until is None else self.held_until

    def reads(self) -> frozenset[str]:
        """Return the names whose new values are worth a tick."""
        return frozenset(self.reading) if self.status == RUNNING and not self.is_paused else frozenset()

    def pause(self, now: float) -> None:
        """Halt what runs, and let all timers stand still until `resume`."""
        if self.status == RUNNING and not self.is_paused:
            self.now = now
            self._take_results()
            self.is_paused = True
            self.lost -= now
            self.main.stack[-1].suspend(now, anew=False)

    def resume(self, now: float) -> None:
        """Go on; the skills that were halted are asked again at the next tick."""
        if self.is_paused:
            self.is_paused = False
            self.lost += now
            self.main.stack[-1].resume(now)

    def abort(self, now: float) -> None:
        """Halt what runs, for good."""
        if self.status == RUNNING:
            self.now = now
            self._take_results()
            self.is_aborting = True
            self.main.halt()
            self.status = FAILURE
            self.world.say(MissionEnded("halted"))

    # What tasks call.

    @property
    def unpaused(self) -> float:
        """Return robot time without the pauses of the mission [s]; unlike `time` it goes on during interrupts."""
        return self.now - self.lost

    def again(self, by: Task | Reaction) -> None:
        """Ask for another tick at this instant."""
        self._again = by

    def is_past(self, time: float) -> bool:
        """Tell whether a time of this course [s] has come."""
        return time - self.time <= ROUNDING

    def has_gone_by(self, seconds: float, since: float) -> bool:
        """Tell whether so much time has gone by since a time without the pauses of the mission."""
        return seconds - (self.unpaused - since) <= ROUNDING

    def chance(self) -> Random:
        """Return a source of chance for one draw: the same for the same seed and the same draws before."""
        self.draws += 1
        return Random(f"{self.settings.seed}/{self.draws}")  # noqa: S311 - no secret, and to be drawn again

    def is_due(self, deadline: float) -> bool:
        """Tell whether a time of this course [s] has come; if not, the engine wakes then."""
        if self.is_past(deadline):
            return True
        self._wake_at(deadline + (self.now - self.time))
        return False

    def watch(self, watched: Watched) -> None:
        """Wake when the condition may have changed."""
        self.reading |= watched.names
        if watched.is_polled:
            self._wake_at(self.now + 1 / self.program.rate)

    def halt(self, task: Task, because: str) -> None:
        """Halt what runs inside a task that fails, and keep the reason."""
        self.reasons[task.number] = self.because = because
        task.halt_below()
        self.because, self.outcome = "", ""

    def failed(self, task: Task, error: Exception) -> None:
        """Report why a task cannot go on."""
        message = words(error)
        self.reasons[task.number] = message
        self.say(Reported(self.program.nodes[task.number].path, message))

    def forget_result(self, leaf: int) -> None:
        """Drop a result that has come for a leaf which is halted before it was taken."""
        self.arrived = [result for result in self.arrived if result[0] != leaf]

    def index_of(self, task: Task) -> int:
        """Return the index of a task in `tasks`."""
        return self._indexes[task]

    def say(self, event: MissionEvent) -> None:
        """Tell the world what happens."""
        self.world.say(event)

    # One tick.

    def _tick_once(self) -> None:
        self._again = self.wake = None
        self.reading.clear()
        self._take_results()
        self.outcome = ""
        self.time = self.now
        status = self.main.tick(self.now)
        if status != RUNNING:
            self._finish(FAILURE if status == FAILURE else SUCCESS)

    def _take_results(self) -> None:
        arrived, self.arrived = self.arrived, []
        for leaf, result in arrived:
            task = self._leaves[leaf]
            if task.is_asked:
                task.ended(result)

    def _finish(self, status: int) -> None:
        self.status = status
        message = self._why() if status == FAILURE else self.main.message
        self.say(MissionEnded(NAMES[status], message, self.outcome or NAMES[status]))

    def _why(self) -> str:
        """Return the path of the node that made the mission fail, and its reason; an outcome may say it all."""
        if self.main.ending is not None:
            return self.main.message
        course = self.main.failed
        number = course.root.number if course and course.root else self.program.main
        while number not in self.reasons:
            failed = [child for child in self._deciding(number) if self.statuses[child] == FAILURE]
            if not failed:
                break
            number = failed[-1]
        path, reason = self.program.nodes[number].path, self.reasons.get(number)
        told = f"{path}: {reason}" if reason else f"{path} failed"
        if isinstance(course, Reaction):
            return f"the reaction of '{course.name}' failed: {told}"
        says_it_all = self.outcome and not reason and number == self.program.main
        return "" if says_it_all else told

    def _deciding(self, number: int) -> tuple[int, ...]:
        """Return the children whose failure may be that of a node."""
        node = self.program.nodes[number]
        if isinstance(node.options, ParallelOptions) and node.options.ends_with:
            return (node.children[node.options.branches.index(node.options.ends_with)],)
        return node.children

    def _wake_at(self, at: float) -> None:
        if self.wake is None or at < self.wake:
            self.wake = at

    def _is_held(self, now: float) -> bool:
        if self.held_until is not None and self.held_until - now > ROUNDING:
            return True
        self.held_until = None
        return False

    def _slow_down(self) -> None:
        self.held_until = self.now + 1 / self.program.rate
        source = self._again
        if isinstance(source, Reaction):
            path = f"interrupts.{source.name}"
        else:
            path = self.program.nodes[source.number if source else self.program.main].path
        if path not in self.named:
            self.named.add(path)
            self.say(Reported(path, f"does not wait: {TICKS_AT_ONCE} ticks at one instant, slowed down from now on"))
