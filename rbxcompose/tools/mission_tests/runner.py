"""Runs a test in the way that it needs, alone or on the whole robot, and judges the result."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import NOT_ARRIVED, EvaluationError, NotArrived, NotArrivedError, Value
from rbxcompose.base.requests import Refused
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.manifest.test_file import LONGEST_TEST
from rbxcompose.missions.components.mission import Mission
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.world import RobotValues, Settings, World, show_briefly
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.requests import CancelMission, PauseMission, ResumeMission
from rbxcompose.missions.execution.world import RobotWorld
from rbxcompose.missions.program.outcomes import IDLE, RUNNING, Result
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.ports import Qos
from rbxcompose.sdk.registry import declared
from rbxcompose.testing.bench import Bench
from rbxcompose.tools.live_rules import LiveRules
from rbxcompose.tools.mission_tests.coverage import SeenWays
from rbxcompose.tools.mission_tests.judge import UnmetExpectation, judge
from rbxcompose.tools.mission_tests.model import FAILS, SUCCEEDS, EventDeed, Mock, Trial, TrialEvent, ValueSetting
from rbxcompose.tools.mission_tests.record import TrialRecord
from rbxcompose.tools.mission_tests.scope import TrialScope, agrees

ROUNDING = 1e-9  # [s]
MOST_INSTANTS = 100_000  # instants at which something happens
MOST_STEPS = 5000
MOST_LINES = 50_000  # of the trace
MOST_WORK = 600_000  # nodes that are started or continued
OWNER = "test"
BEGINS_WITHIN = 60.0  # [s] after the last event of the test; after that, something never comes
_COMMANDS = {"pause": PauseMission, "resume": ResumeMission, "cancel": CancelMission}


@dataclass(slots=True)
class MockedCall:
    """A call whose answer is due at `due` [s]; while it is held, `due` is the remaining time."""

    leaf: int
    mock: Mock
    arguments: Mapping[str, Value]
    due: float
    is_held: bool = False


class Mocked:
    """Answers calls; the outcome of a call is decided when it ends, so that a halted call does not count."""

    def __init__(self, mocks: Mapping[str, Mock]) -> None:
        self.mocks = mocks
        self._calls: dict[int, MockedCall] = {}
        self._ended: Counter[str] = Counter()

    def start(self, leaf: int, name: str, arguments: Mapping[str, Value], now: float) -> None:
        """Begin to answer a call."""
        mock = self.mocks[name]
        self._calls[leaf] = MockedCall(leaf, mock, arguments, now + mock.takes)

    def halt(self, leaf: int) -> bool:
        """Forget a call; return whether there was one."""
        return self._calls.pop(leaf, None) is not None

    def pause(self, leaf: int, now: float) -> bool:
        """Hold a call; return whether there is one."""
        return self._shift(leaf, -now, True)

    def resume(self, leaf: int, now: float) -> bool:
        """Let a call continue; return whether there is one."""
        return self._shift(leaf, now, False)

    def _shift(self, leaf: int, seconds: float, is_held: bool) -> bool:
        call = self._calls.get(leaf)
        if call is not None and call.is_held != is_held:
            call.due, call.is_held = call.due + seconds, is_held
        return call is not None

    def next_due(self) -> float | None:
        """Return when the next call ends [s]."""
        return min((call.due for call in self._calls.values() if not call.is_held), default=None)

    def ended(self, now: float) -> Iterator[tuple[MockedCall, Result]]:
        """Yield the calls that end now, ordered by due time, then by leaf."""
        due = [call for call in self._calls.values() if not call.is_held and call.due <= now + ROUNDING]
        for call in sorted(due, key=lambda call: (call.due, call.leaf)):
            del self._calls[call.leaf]
            self._ended[call.mock.name] += 1
            yield call, self._result(call)

    def _result(self, call: MockedCall) -> Result:
        mock = call.mock
        outcome = mock.outcome(self._ended[mock.name], call.arguments.get(mock.main), agrees)
        succeeds = mock.outcomes.get(outcome, outcome) == SUCCEEDS
        own = "" if outcome in (SUCCEEDS, FAILS) else outcome
        return Result(succeeds, "" if succeeds else mock.message, own)


class SetValues:
    """The values that a test has set, over those of the robot; what it sets is a line of the record."""

    def __init__(self, trial: Trial, record: TrialRecord, now: Callable[[], float]) -> None:
        self._trial, self._record, self._now = trial, record, now
        self.below: RobotValues | None = None  # the robot's own values, if it runs
        self._set: dict[str, Value] = {}
        self._times: dict[str, float] = {}
        self._counts: dict[str, int] = {}

    def set(self, settings: Mapping[str, ValueSetting], known: Mapping[str, Value]) -> None:
        """Compute all values, then set them; an expression without a value ends the test."""
        now, names = self._now(), self._trial.names
        scope = TrialScope({**self._trial.inputs, **known}, names.places, self)
        try:
            computed = {name: setting(scope) for name, setting in settings.items()}
        except (EvaluationError, NotArrivedError) as error:
            self._record.trouble = f"the test cannot set its values at {now:g} s: {error}"
            return
        for name, value in computed.items():
            self._counts[name] = self.count(name) + 1
            self._set[name], self._times[name] = value, now
            self._record.note(f"{name} is {show_briefly(names.values.get(name), value)}")

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value."""
        if name in self._set:
            return self._set[name]
        return NOT_ARRIVED if self.below is None else self.below.value(name)

    def age(self, name: str, /) -> float | NotArrived:
        """Return the age of a value [s]."""
        if name in self._times:
            return self._now() - self._times[name]
        return NOT_ARRIVED if self.below is None else self.below.age(name)

    def count(self, name: str, /) -> int:
        """Return how many values have arrived; those of the robot count only until the test sets the first one."""
        if name in self._counts:
            return self._counts[name]
        return 0 if self.below is None else self.below.count(name)


WhenEnded = Callable[[int, Result], None]


class TrialRun(ABC):
    """What a test does while its mission runs: it answers calls, sets values, and records what happens."""

    ended: WhenEnded
    """Notifies the engine of the end of a call."""

    def __init__(self, trial: Trial, seen: SeenWays) -> None:
        self.trial, self.seen = trial, seen
        self.record = TrialRecord(trial.mission)
        self.mocked = Mocked(trial.mocks)
        self.values = SetValues(trial, self.record, lambda: self.now)
        self.events = list(trial.events)  # events still to come

    @property
    @abstractmethod
    def now(self) -> float:
        """Return robot time [s]."""

    def end_calls(self) -> None:
        """End the calls that are due."""
        for call, result in self.mocked.ended(self.now):
            self.record.now = self.now
            if result.success:
                self.values.set(call.mock.sets, call.arguments)
            self.ended(call.leaf, result)

    def finished(self, engine: Engine) -> TrialRecord:
        """Return the record of a run that has ended."""
        self.record.late = len(self.events)
        self.record.data = dict(engine.data)
        return self.record

    @abstractmethod
    def await_calls(self) -> None:
        """Have calls that have begun, or go on, end when they are due."""


class TrialStage(TrialRun):
    """A mission that runs alone."""

    now = 0.0

    def __init__(self, trial: Trial, seen: SeenWays) -> None:
        super().__init__(trial, seen)
        self.is_paused = False
        world = TrialWorld(self, None)
        self.engine = Engine(trial.program, trial.names, trial.inputs, world, Settings(observer=seen))
        self.ended = self.engine.ended

    def await_calls(self) -> None:
        """Do nothing: each instant begins with the calls that end."""

    def run(self) -> TrialRecord:
        """Jump from instant to instant until the mission or the test has ended, and return what happened."""
        until = self.trial.expect.until
        for _ in range(MOST_INSTANTS):
            self._instant()
            if self.engine.status not in (IDLE, RUNNING) or self.record.trouble:
                break
            if excess := self._excess():
                self.record.trouble = f"did not end: {excess} within {self.now:.0f} s{self._unwaiting()}"
                break
            times = [self.mocked.next_due(), self.engine.next_wake(), self.events[0].at if self.events else None]
            upcoming = min((time for time in times if time is not None), default=None)
            if upcoming is None or upcoming > (LONGEST_TEST if until is None else until) + ROUNDING:
                self._leave(until, upcoming)
                break
            self.now = self.record.now = max(upcoming, self.now)
        else:
            self.record.trouble = f"did not end: {MOST_INSTANTS:,} things happened within {self.now:g} s"
        return self.finished(self.engine)

    def _excess(self) -> str:
        """Return what there is too much of, in words; counted, so that a test ends the same way on every computer."""
        if len(self.record.steps) > MOST_STEPS:
            return f"{MOST_STEPS} steps"
        if len(self.record.lines) > MOST_LINES:
            return f"{MOST_LINES:,} lines of the trace"
        return f"{MOST_WORK:,} nodes started or continued" if self.engine.work > MOST_WORK else ""

    def _unwaiting(self) -> str:
        """Return the outermost loop that does not wait, in words."""
        return f": {min(self.engine.named, key=len)} does not wait" if self.engine.named else ""

    def _leave(self, until: float | None, upcoming: float | None) -> None:
        if until is not None:
            self.now = self.record.now = until
        elif upcoming is None:
            self.record.trouble = f"did not end: since {self.now:g} s it waits for something that the test does not do"
        else:
            self.record.trouble = f"did not end within {LONGEST_TEST:g} s of robot time"

    def _instant(self) -> None:
        """Do everything that is due: end calls, let the test act, tick the mission."""
        self.end_calls()
        while self.events and self.events[0].at <= self.now + ROUNDING:
            for deed in self.events.pop(0).deeds:
                self._do(deed)
        if not self.is_paused:
            self.engine.tick(self.now)

    def _do(self, deed: EventDeed) -> None:
        match deed.word:
            case "set":
                self.values.set(deed.settings, {})
            case "stop" | "pause":
                self.record.note(f"the test {'stops the robot' if deed.word == 'stop' else 'pauses the mission'}")
                self.is_paused = True
                self.engine.pause(self.now)
            case "resume":
                self.record.note("the test resumes the mission")
                self.is_paused = False
                self.engine.resume(self.now)
            case _:
                self.record.note("the test releases the stop")


class RobotRun(TrialRun):
    """A robot whose executive runs the mission in the world of the test."""

    def __init__(self, trial: Trial, seen: SeenWays) -> None:
        super().__init__(trial, seen)
        plan = _with_mission(trial.plan, trial)
        self.bench = Bench(plan=plan, start=False, rules=LiveRules(trial.robot))
        name = next(one.name for one in plan.instances if declared(one.type, one.config, RunsMissions))
        executive = self.bench.component(name)
        if not isinstance(executive, Mission):
            raise TypeError(f"'{name}' runs no missions")
        self.name, self.executive = name, executive
        self.make, executive.missions.make = executive.missions.make, self.make_world
        executive.missions.observer = seen

    @property
    def now(self) -> float:
        """Return robot time [s]."""
        return self.bench.clock.now()

    def make_world(self, ended: WhenEnded, say: Callable[[MissionEvent], None]) -> tuple[World, RobotWorld]:
        """Return the world of the test around that of the robot."""
        world, robot = self.make(ended, say)
        self.values.below = world
        self.ended = ended
        return TrialWorld(self, world), robot

    def run(self) -> TrialRecord:
        """Run until the mission or the test has ended, and return what happened."""
        for event in self.events:
            self.bench.scheduler.at(event.at, OWNER, lambda event=event: self._happens(event))  # type: ignore[misc]
        self.bench.host.start()
        until = self.trial.expect.until
        if not self.bench.run_until(self._is_over, LONGEST_TEST if until is None else until) and until is None:
            self.record.trouble = f"did not end within {LONGEST_TEST:g} s of robot time"
        self.record.now = self.now
        return self.finished(self.executive.missions.runs[self.trial.mission].engine)

    def _is_over(self) -> bool:
        if self.bench.host.hosted[self.name].component is not self.executive:
            failed = [record.text for record in self.bench.records if record.source == self.name]
            self.record.trouble = f"the executive failed: {failed[-1] if failed else 'without a word'}"
        elif not self.events and self.now > BEGINS_WITHIN and self.trial.expect.until is None:
            run = self.executive.missions.runs[self.trial.mission]
            if run.began is None and (missing := run.missing()):
                names = ", ".join(f"${name}" for name in missing)
                self.record.trouble = f"the mission does not start: nothing has arrived for {names}"
        return self.record.end is not None or bool(self.record.trouble)

    def _happens(self, event: TrialEvent) -> None:
        self.record.now = self.now
        self.events.remove(event)
        for deed in event.deeds:
            try:
                self._do(deed)
            except Refused as refusal:
                self.record.trouble = f"the robot refuses to {deed.word} at {self.now:g} s: {refusal}"
        self.executive.look_soon()

    def _do(self, deed: EventDeed) -> None:
        match deed.word:
            case "set":
                self.values.set(deed.settings, {})
            case "stop":
                self.record.note("the test stops the robot")
                self.bench.host.stop()
            case "release":
                self.record.note("the test releases the stop")
                self.bench.host.release()
            case "publish" if deed.message is not None:
                self.record.note(f"the test publishes on {deed.topic}")
                self.bench.bus.publisher(OWNER, deed.topic, type(deed.message), Qos.COMMAND)(deed.message)
            case "fault" if deed.request is not None:
                self.record.note(f"the test brings a fault: {deed.request.words}")
                self.bench.host.ask(deed.component, deed.request)
            case word:
                self.record.note(f"the test {word}s the mission")
                self.bench.host.ask(self.name, _COMMANDS[word](self.trial.mission))

    def settle(self) -> None:
        """End the calls that are due, and have the executive examine the mission."""
        self.end_calls()
        self.executive.look_soon()

    def await_calls(self) -> None:
        """Schedule the end of the call that is due next."""
        if (due := self.mocked.next_due()) is not None:
            self.bench.scheduler.at(due, OWNER, self.settle)


class TrialWorld:
    """The world of a mission, except for what the test answers or sets; without a `robot`, that is all."""

    def __init__(self, run: TrialRun, robot: World | None) -> None:
        self._run, self._robot = run, robot
        self._values, self._mocked = run.values, run.mocked

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the test's value, else the robot's."""
        return self._values.value(name)

    def age(self, name: str, /) -> float | NotArrived:
        """Return the age of a value [s]."""
        return self._values.age(name)

    def count(self, name: str, /) -> int:
        """Return how many values have arrived."""
        return self._values.count(name)

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Answer a call, or let the robot do it."""
        if self._robot is None or skill in self._mocked.mocks:
            self._mocked.start(leaf, skill, arguments, self._run.now)
            self._run.await_calls()
        else:
            self._robot.start(leaf, skill, arguments)

    def halt(self, leaf: int, /) -> None:
        """Stop a call."""
        if not self._mocked.halt(leaf) and self._robot is not None:
            self._robot.halt(leaf)

    def pause(self, leaf: int, /) -> None:
        """Hold a call."""
        if not self._mocked.pause(leaf, self._run.now) and self._robot is not None:
            self._robot.pause(leaf)

    def resume(self, leaf: int, /) -> None:
        """Let a call continue."""
        if self._mocked.resume(leaf, self._run.now):
            self._run.await_calls()
        elif self._robot is not None:
            self._robot.resume(leaf)

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Publish on the robot; without one there is no subscriber, and only the event counts."""
        if self._robot is not None:
            self._robot.publish(topic, fields)

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Answer a call, or let the robot do it."""
        if self._robot is None or service in self._mocked.mocks:
            self.start(leaf, service, fields)
        else:
            self._robot.call(leaf, service, fields)

    def say(self, event: MissionEvent, /) -> None:
        """Keep an event, and pass it on."""
        self._run.record.now = self._run.now
        self._run.record.receive(event)
        self._run.seen.receive(event)
        if self._robot is not None:
            self._robot.say(event)


def _with_mission(plan: Plan, trial: Trial) -> Plan:
    """Return the plan whose executive starts the mission of the test, with its inputs."""

    def changed(instance: Instance) -> Instance:
        if not isinstance(instance.config, MissionConfig):
            return instance
        inputs = {**instance.config.inputs, trial.mission: dict(trial.inputs)}
        update = {"start": trial.mission, "inputs": inputs, "triggers": {}}
        return replace(instance, config=instance.config.model_copy(update=update))

    return replace(plan, instances=tuple(changed(instance) for instance in plan.instances), start=trial.mission)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of a test: what happened, what was not as expected, and which paths its mission took."""

    trial: Trial
    record: TrialRecord
    problems: list[UnmetExpectation]
    seen: SeenWays

    @property
    def passed(self) -> bool:
        """Return whether all was as expected."""
        return not self.problems


def run_trial(trial: Trial, seen: SeenWays | None = None) -> Verdict:
    """Run a test: the mission alone if the test answers everything that it needs, else the whole robot.

    `seen` may observe more than the paths that were taken.
    """
    seen = seen or SeenWays()
    record = TrialStage(trial, seen).run() if trial.is_complete else RobotRun(trial, seen).run()
    types = {name: datum.type for name, datum in trial.program.data.items()}
    return Verdict(trial, record, judge(trial.expect, record, types), seen)
