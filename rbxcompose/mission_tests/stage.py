"""Runs a mission alone, in virtual time: the test answers every skill and sets every value."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.expressions.values import NotArrived, Value
from rbxcompose.manifest.test_file import LONGEST_TEST
from rbxcompose.mission_tests.mocked import ROUNDING, Mocked, SetValues
from rbxcompose.mission_tests.model import EventDeed, Trial
from rbxcompose.mission_tests.record import TrialRecord
from rbxcompose.mission_tests.watched_run import Setter, Watcher
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.world import Settings
from rbxcompose.missions.program.statuses import IDLE, RUNNING

MOST_INSTANTS = 100_000  # instants at which something happens
MOST_STEPS = 5000
MOST_LINES = 50_000  # of the trace
MOST_WORK = 600_000  # nodes that are started or continued


class TrialStage:
    """The world of a mission that runs alone."""

    def __init__(self, trial: Trial, watcher: Watcher) -> None:
        self.trial = trial
        self.watcher = watcher
        self.now = 0.0
        self.is_paused = False
        self.record = TrialRecord(trial.mission, trial.names.skills)
        self.mocked = Mocked(trial.mocks)
        self.values = SetValues(trial.names, trial.inputs)
        self.setter = Setter(trial, self.record, self.values)
        self.events = list(trial.events)  # events still to come
        self.engine = Engine(trial.program, trial.names, trial.inputs, self, Settings(observer=watcher))

    # What the engine calls.

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value."""
        return self.values.value(name)

    def age(self, name: str, /) -> float | NotArrived:
        """Return the age of a value [s]."""
        return self.values.age(name, self.now)

    def count(self, name: str, /) -> int:
        """Return how often it was set."""
        return self.values.count(name)

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Begin a call."""
        self.mocked.start(leaf, skill, arguments, self.now)

    def halt(self, leaf: int, /) -> None:
        """Forget a call."""
        self.mocked.halt(leaf)

    def pause(self, leaf: int, /) -> None:
        """Hold a call."""
        self.mocked.pause(leaf, self.now)

    def resume(self, leaf: int, /) -> None:
        """Let a call continue."""
        self.mocked.resume(leaf, self.now)

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Do nothing: there is no subscriber, only the event counts."""

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Begin a call."""
        self.start(leaf, service, fields)

    def say(self, event: MissionEvent, /) -> None:
        """Record an event."""
        self.record.hear(event)
        self.watcher.hear(event)

    # The run.

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
            upcoming = self._next()
            if upcoming is None or upcoming > (LONGEST_TEST if until is None else until) + ROUNDING:
                self._leave(until, upcoming)
                break
            self.now = self.record.now = max(upcoming, self.now)
        else:
            self.record.trouble = f"did not end: {MOST_INSTANTS:,} things happened within {self.now:g} s"
        self.record.late = len(self.events)
        self.record.data = dict(self.engine.data)
        return self.record

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
        for call, result in self.mocked.ended(self.now):
            if result.success:
                self.setter.set(call.mock.sets, call.arguments, self.now)
            self.engine.ended(call.leaf, result)
        while self.events and self.events[0].at <= self.now + ROUNDING:
            for deed in self.events.pop(0).deeds:
                self._do(deed)
        if not self.is_paused:
            self.engine.tick(self.now)

    def _do(self, deed: EventDeed) -> None:
        match deed.word:
            case "set":
                self.setter.set(deed.settings, {}, self.now)
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

    def _next(self) -> float | None:
        times = [self.mocked.next_due(), self.engine.next_wake(), self.events[0].at if self.events else None]
        return min((time for time in times if time is not None), default=None)
