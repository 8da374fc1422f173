"""The engine runs one mission: single-threaded, pure, with time as an argument, idle while there is nothing to do."""

from collections.abc import Mapping

from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.engine.build import Builder
from rbxcompose.missions.engine.debugger import Debugger
from rbxcompose.missions.engine.events import MissionEnded, Reported
from rbxcompose.missions.engine.interventions import Intervention
from rbxcompose.missions.engine.task import ROUNDING, EngineBase, Reaction, Task
from rbxcompose.missions.engine.world import PLAIN, Settings, World
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, NAMES, RUNNING, SUCCESS, Result
from rbxcompose.missions.program.program import Program, RobotNames

TICKS_AT_ONCE = 100  # at one instant; then the mission is slowed down to its rate


class Engine(EngineBase):
    """Ticks the tasks of a program.

    `program` is linked: the missions that it uses are part of it, each as often as it is used. A tick first takes the
    results that have arrived, then checks the interrupts, then ticks the course on top. It is repeated at the same
    instant as long as something requests that.
    """

    def __init__(
        self, program: Program, robot: RobotNames, inputs: Mapping[str, Value], world: World, settings: Settings = PLAIN
    ) -> None:
        super().__init__(link(program, robot.missions), robot, world, settings)
        self.status = IDLE  # of the mission
        self.is_paused = False
        builder = Builder(self, robot)
        self.main = builder.run(self.program)
        self.tasks, self.runs, self._leaves = builder.tasks, builder.runs, builder.leaves
        self._indexes = {task: index for index, task in enumerate(self.tasks)}
        self.inputs = dict(inputs)
        self.debugger = Debugger(self, self.tasks, self.runs, self._take_results)
        self.instant = -1.0
        self.ticks = 0  # at this instant
        self.held_until: float | None = None  # slowed down until then [s]
        self.named: set[str] = set()  # loops that were reported for not waiting

    # Called by the shell.

    @property
    def data(self) -> Mapping[str, Value]:
        """Return the data of the mission, by name."""
        return self.main.data

    def ended(self, leaf: int, result: Result) -> None:
        """Take the result of a skill or a call; it takes effect at the next tick."""
        self.arrived.append((leaf, result))

    def tick(self, now: float) -> int:
        """Do everything that is due at `now` [s], and return the mission's status."""
        self.now = now
        if self.status not in (IDLE, RUNNING) or self.is_paused or self._is_held(now):
            return self.status
        if self.status == IDLE:
            self.status = RUNNING
            self.main.begin(self.inputs)
        if now > self.instant:
            self.instant, self.ticks = now, 0
        while self.status == RUNNING:
            self.ticks += 1
            self._tick_once()
            if not (self.wants_again or self.arrived) or self.stops:
                break
            if self.ticks >= TICKS_AT_ONCE:
                self._slow_down()
                break
        return self.status

    def next_wake(self) -> float | None:
        """Return when to tick next [s] unless something happens earlier; None if no time is set."""
        if self.status != RUNNING or self.is_paused:
            return None
        return self.wake if self.held_until is None else self.held_until

    def reads(self) -> frozenset[str]:
        """Return the names whose new values are worth a tick."""
        return frozenset(self.reading) if self.status == RUNNING and not self.is_paused else frozenset()

    def pause(self, now: float) -> None:
        """Halt what runs, and stop all timers until `resume`."""
        if self.status == RUNNING and not self.is_paused:
            self.now = now
            self._take_results()
            self.is_paused = True
            self.lost -= now
            self.main.stack[-1].suspend(now, from_start=False)

    def resume(self, now: float) -> None:
        """Continue; the skills that were halted are requested again at the next tick."""
        if self.is_paused:
            self.is_paused = False
            self.debugger.release()
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

    def stop_request(self, leaf: int, because: str, now: float) -> None:
        """Stop the request of a leaf, for good; whoever reads the story learns why."""
        self.now, self.because = now, because
        self._leaves[leaf].stop()
        self.because = ""

    def forget_requests(self) -> None:
        """Take the results that have arrived; all other requests are lost, with the process that made them."""
        self._take_results()
        for leaf in self._leaves.values():
            leaf.lose()

    def intervene(self, intervention: Intervention, now: float) -> None:
        """Do what a person wants; it takes effect at the next tick.

        Raises:
            NotPossible: if the mission cannot do it, with the reason; nothing has changed then.
        """
        self.now = now
        self.debugger.do(intervention)

    def index_of(self, task: Task) -> int:
        """Return the index of a task in `tasks`."""
        return self._indexes[task]

    # One tick.

    def _tick_once(self) -> None:
        self.wants_again = self.wake = None
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
        doubt = self._doubt() if status == SUCCESS else ""
        self.say(MissionEnded(NAMES[status], message, self.outcome or NAMES[status], doubt))

    def _doubt(self) -> str:
        """Return that all steps which may fail have failed; empty if one succeeded each time it could."""
        failed = [task.only_failed() for task in self.tasks]
        if False in failed or True not in failed:
            return ""
        count = failed.count(True)
        return f"all {count} optional steps failed" if count > 1 else "its only optional step failed"

    def _why(self) -> str:
        """Return the place of the node that made the mission fail and its reason; empty if the outcome says it all."""
        if self.main.ending is not None:
            return self.main.message
        course = self.main.failed
        number = course.root.number if course and course.root else self.program.main
        while number not in self.reasons:
            failed = [child for child in self._deciding(number) if self.statuses[child] == FAILURE]
            if not failed:
                break
            number = failed[-1]
        node = self.program.nodes[number]
        trouble = f"{node.span.place}: {self.reasons.get(number) or f'{node.name or node.step.word} failed'}"
        if isinstance(course, Reaction):
            return f"the reaction of '{course.name}' failed: {trouble}"
        says_it_all = self.outcome and not self.reasons.get(number) and number == self.program.main
        return "" if says_it_all else trouble

    def _deciding(self, number: int) -> tuple[int, ...]:
        """Return the children whose failure can make a node fail."""
        node = self.program.nodes[number]
        return node.step.branches.deciding(node.children) if node.step.branches else node.children

    def _is_held(self, now: float) -> bool:
        if self.held_until is not None and self.held_until - now > ROUNDING:
            return True
        self.held_until = None
        return False

    def _slow_down(self) -> None:
        self.held_until = self.now + 1 / self.program.rate
        source = self.wants_again
        place = source.place if source else self.program.nodes[self.program.main].span.place
        if place not in self.named:
            self.named.add(place)
            self.say(Reported(place, f"does not wait: {TICKS_AT_ONCE} ticks at one instant, slowed down from now on"))
