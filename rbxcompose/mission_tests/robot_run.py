"""Runs a mission on the whole robot, in virtual time: whatever the test does not answer runs for real."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from rbxcompose.components.mission import Mission, MissionConfig
from rbxcompose.executive.requests import CancelMission, PauseMission, ResumeMission
from rbxcompose.executive.world import RobotWorld
from rbxcompose.expressions.values import NotArrived, Value
from rbxcompose.manifest.test_file import LONGEST_TEST
from rbxcompose.mission_tests.mocked import Mocked, SetValues
from rbxcompose.mission_tests.model import EventDeed, Trial, TrialEvent
from rbxcompose.mission_tests.record import TrialRecord
from rbxcompose.mission_tests.watched_run import Setter, Watcher
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.world import World
from rbxcompose.missions.program.results import Result
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.qos import Qos
from rbxcompose.requests import Refused
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.registry import declared
from rbxcompose.testing.bench import Bench

OWNER = "test"
WhenEnded = Callable[[int, Result], None]
BEGINS_WITHIN = 60.0  # [s] after the last event of the test; after that, something never comes
_COMMANDS = {"pause": PauseMission, "resume": ResumeMission, "cancel": CancelMission}


class RobotRun:
    """A robot whose executive runs the mission in the world of the test."""

    def __init__(self, trial: Trial, watcher: Watcher) -> None:
        self.trial = trial
        self.watcher = watcher
        self.record = TrialRecord(trial.mission, trial.names.skills)
        self.mocked = Mocked(trial.mocks)
        self.values = SetValues(trial.names, trial.inputs)
        self.setter = Setter(trial, self.record, self.values)
        self.ended: WhenEnded = lambda leaf, result: None  # notifies the engine, once there is one
        self.events = list(trial.events)  # events still to come
        plan = _with_mission(trial.plan, trial)
        self.bench = Bench(plan=plan, start=False)
        name = next(one.name for one in plan.instances if declared(one.type, one.config, RunsMissions))
        executive = self.bench.component(name)
        if not isinstance(executive, Mission):
            raise TypeError(f"'{name}' runs no missions")
        self.name, self.executive = name, executive
        self.make, executive.missions.make = executive.missions.make, self.make_world
        executive.missions.observer = watcher

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
        self.record.late = len(self.events)
        self.record.data = dict(self.executive.missions.runs[self.trial.mission].engine.data)
        return self.record

    def _is_over(self) -> bool:
        if self.bench.host.hosted[self.name].component is not self.executive:
            failed = [one.text for one in self.bench.records if one.source == self.name]
            self.record.trouble = f"the executive failed: {failed[-1] if failed else 'without a word'}"
        elif not self.events and self.now > BEGINS_WITHIN:
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
        self.look()

    def _do(self, deed: EventDeed) -> None:
        match deed.word:
            case "set":
                self.setter.set(deed.settings, {}, self.now)
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
        """End the calls that are due."""
        for call, result in self.mocked.ended(self.now):
            self.record.now = self.now
            if result.success:
                self.setter.set(call.mock.sets, call.arguments, self.now)
            self.ended(call.leaf, result)
        self.look()

    def await_calls(self) -> None:
        """Schedule the end of the call that is due next."""
        due = self.mocked.next_due()
        if due is not None:
            self.bench.scheduler.at(due, OWNER, self.settle)

    def look(self) -> None:
        """Have the executive examine the mission."""
        self.executive.look_soon()


class TrialWorld:
    """The world of a robot's mission, except for what the test answers or sets."""

    def __init__(self, run: RobotRun, robot: World) -> None:
        self._run = run
        self._robot = robot

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the test's value, else the robot's."""
        return self._run.values.value(name)

    def age(self, name: str, /) -> float | NotArrived:
        """Return the age of a value [s]."""
        return self._run.values.age(name, self._run.now)

    def count(self, name: str, /) -> int:
        """Return how many values have arrived."""
        return self._run.values.count(name)

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Answer a call, or let the robot do it."""
        if skill not in self._run.mocked.mocks:
            self._robot.start(leaf, skill, arguments)
            return
        self._run.mocked.start(leaf, skill, arguments, self._run.now)
        self._run.await_calls()

    def halt(self, leaf: int, /) -> None:
        """Stop a call."""
        if not self._run.mocked.halt(leaf):
            self._robot.halt(leaf)

    def pause(self, leaf: int, /) -> None:
        """Hold a call."""
        if not self._run.mocked.pause(leaf, self._run.now):
            self._robot.pause(leaf)

    def resume(self, leaf: int, /) -> None:
        """Let a call continue."""
        if self._run.mocked.resume(leaf, self._run.now):
            self._run.await_calls()
        else:
            self._robot.resume(leaf)

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Publish on the robot."""
        self._robot.publish(topic, fields)

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Answer a call, or let the robot do it."""
        if service in self._run.mocked.mocks:
            self.start(leaf, service, fields)
        else:
            self._robot.call(leaf, service, fields)

    def say(self, event: MissionEvent, /) -> None:
        """Keep an event, and pass it on."""
        self._run.record.now = self._run.now
        self._run.record.hear(event)
        self._run.watcher.hear(event)
        self._robot.say(event)


def _with_mission(plan: Plan, trial: Trial) -> Plan:
    """Return the plan whose executive starts the mission of the test, with its inputs."""

    def changed(one: Instance) -> Instance:
        if not isinstance(one.config, MissionConfig):
            return one
        inputs = {**one.config.inputs, trial.mission: dict(trial.inputs)}
        return replace(one, config=one.config.model_copy(update={"start": trial.mission, "inputs": inputs}))

    return replace(plan, instances=tuple(changed(one) for one in plan.instances), start=trial.mission)
