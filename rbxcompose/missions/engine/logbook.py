"""The log of a mission: its inputs and what it did, as plain records from which it can be replayed.

Each record is a map for JSON with `time` [s] of robot time, `mission`, `run` (how often the mission has been run), and
`event`. Inputs are `begin`, `tick` (with the values read and the results that arrived), `pause`, `resume`, `abort`,
`intervene` (with what a person did while debugging); all other records are events of the engine. `log_replay.py` gives
the same inputs to the same engine again.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from rbxcompose.base.expressions.values import NotArrived, Value
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.interventions import INTERVENTIONS, ChangeData, Intervention
from rbxcompose.missions.engine.snapshot import to_plain
from rbxcompose.missions.engine.world import Settings, World
from rbxcompose.missions.program.outcomes import Result

BEGIN, TICK, PAUSE, RESUME, ABORT, INTERVENE = "begin", "tick", "pause", "resume", "abort", "intervene"
RESTORE = "restore"  # from a snapshot, which the log does not hold
EXCHANGE = "exchange"  # for a changed mission, which the log does not hold either
INPUTS = frozenset({BEGIN, TICK, PAUSE, RESUME, ABORT, INTERVENE, RESTORE, EXCHANGE})

V = TypeVar("V")
LogRecord = dict[str, Any]
Write = Callable[[LogRecord], None]
_CAPITAL = re.compile(r"(?<!^)(?=[A-Z])")


def record_of(event: MissionEvent) -> LogRecord:
    """Return an event as a record: `SkillStarted` becomes `skill_started`."""
    name = _CAPITAL.sub("_", type(event).__name__).lower()
    return {"event": name, **{field.name: to_plain(getattr(event, field.name)) for field in fields(event)}}


class LoggedWorld:
    """A wrapper around the real world that logs everything read from it; records of ticks hold only what is new."""

    def __init__(self, world: World, write: Write) -> None:
        self._world, self._write = world, write
        self._known: dict[str, Any] = {}  # last values read
        self._read: dict[str, Any] = {}  # new values since the last record
        self._results: list[Any] = []

    def begin(self, inputs: Mapping[str, Value], settings: Settings) -> None:
        """Log how the mission begins."""
        start_at = {str(number): state for number, state in settings.start_at.items()}
        given = {name: to_plain(value) for name, value in inputs.items()}
        self._write({"event": BEGIN, "inputs": given, "seed": settings.seed, "start_at": start_at})

    def arrived(self, leaf: int, result: Result) -> None:
        """Note a result, which takes effect at the next tick."""
        self._results.append([leaf, to_plain(result)])

    def did(self, what: str, intervention: Intervention | None = None) -> None:
        """Log a call of the engine, with what the engine read during it, and what a person did."""
        record: LogRecord = {"event": what}
        if intervention:
            if isinstance(intervention, ChangeData):
                intervention = replace(intervention, value=to_plain(intervention.value))
            record["did"] = INTERVENTIONS.to_data(intervention)
        if self._read:
            record["read"], self._read = self._read, {}
        if self._results:
            record["results"], self._results = self._results, []
        self._write(record)

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value."""
        return self._noted(f"value {name}", self._world.value(name))

    def age(self, name: str, /) -> float | NotArrived:
        """Return the time since the last message [s]."""
        return self._noted(f"age {name}", self._world.age(name))

    def count(self, name: str, /) -> int:
        """Return how many messages have arrived."""
        return self._noted(f"count {name}", self._world.count(name))

    def _noted(self, key: str, value: V) -> V:
        read: Any = value
        plain = to_plain(read)
        if key not in self._known or self._known[key] != plain:
            self._known[key] = self._read[key] = plain
        return value

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Forward it; log an exception, which is a result of the leaf as well."""
        self._tried(leaf, lambda: self._world.start(leaf, skill, arguments))

    def call(self, leaf: int, service: str, request: Mapping[str, Value], /) -> None:
        """Forward it, like `start`."""
        self._tried(leaf, lambda: self._world.call(leaf, service, request))

    def publish(self, topic: str, message: Mapping[str, Value], /) -> None:
        """Forward it, like `start`."""
        self._tried(0, lambda: self._world.publish(topic, message))

    def _tried(self, leaf: int, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:
            self._read.setdefault("raised", []).append([leaf, type(error).__name__, str(error)])
            raise

    def halt(self, leaf: int, /) -> None:
        """Forward it."""
        self._world.halt(leaf)

    def pause(self, leaf: int, /) -> None:
        """Forward it."""
        self._world.pause(leaf)

    def resume(self, leaf: int, /) -> None:
        """Forward it."""
        self._world.resume(leaf)

    def say(self, event: MissionEvent, /) -> None:
        """Log it and forward it."""
        self._write(record_of(event))
        self._world.say(event)
