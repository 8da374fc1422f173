"""What both ways of running a test share: the observers, and the setting of values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from rbxcompose.expressions.values import EvaluationError, NotArrivedError, Value
from rbxcompose.mission_tests.mocked import SetValues
from rbxcompose.mission_tests.model import Trial, ValueSetting
from rbxcompose.mission_tests.record import TrialRecord
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.value_text import show_briefly
from rbxcompose.missions.engine.world import Observer


class Watcher(Observer, Protocol):
    """An observer of the paths that a mission takes."""

    def hear(self, event: MissionEvent, /) -> None:
        """Handle an event of the mission."""
        ...


class Setter:
    """Sets values for a test and reports them; an expression without a value ends the test."""

    def __init__(self, trial: Trial, record: TrialRecord, values: SetValues) -> None:
        self.trial = trial
        self.record = record
        self.values = values

    def set(self, settings: Mapping[str, ValueSetting], known: Mapping[str, Value], now: float) -> set[str]:
        """Set values; return their names."""
        try:
            computed = self.values.set(settings, known, now)
        except (EvaluationError, NotArrivedError) as error:
            self.record.trouble = f"the test cannot set its values at {now:g} s: {error}"
            return set()
        for name, value in computed.items():
            self.record.note(f"{name} is {show_briefly(self.trial.names.values.get(name), value)}")
        return set(computed)
