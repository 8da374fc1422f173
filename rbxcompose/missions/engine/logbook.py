"""The log of a mission: its inputs and what it did, as plain records from which it can be replayed.

Each record is a map for JSON with `time` [s] of robot time, `mission`, `run` (how often the mission has been run), and
`event`. Inputs are `begin`, `tick` (with the values read and the results that arrived), `pause`, `resume`, `abort`,
`intervene` (with what a person did while debugging); all other records are events of the engine. A replay gives the
same inputs to the same engine again; a log is not trusted: each of its records is checked once, when it is read.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

from rbxcompose.base.expressions.values import NOT_ARRIVED, NotArrived, Value, is_number
from rbxcompose.base.requests import UnreadableError
from rbxcompose.base.units import MOST
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.interventions import INTERVENTIONS, ChangeData, Intervention, NotPossible
from rbxcompose.missions.engine.snapshot import NoValue, from_plain, to_plain
from rbxcompose.missions.engine.world import PLAIN, Settings, World
from rbxcompose.missions.program.outcomes import Result
from rbxcompose.missions.program.program import Program, RobotNames

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


MOST_WORK = 600_000  # nodes that are started or continued, in all runs of a log: enough for all that a robot keeps
_WORK_TO_BUILD = 5  # for one node
_WORK_TO_READ = 2  # for one record
_NOTHING: Mapping[str, Value] = MappingProxyType({})


class ReplayError(ValueError):
    """Raised when records are not the log of a mission from its start; `record` is the index of the wrong one."""

    def __init__(self, problem: str, record: int) -> None:
        super().__init__(problem)
        self.record = record


class OtherMissionError(ReplayError):
    """Raised when a log does not fit the mission: it has results of other nodes, or lacks what the mission reads."""


class OtherInterventionError(ReplayError):
    """Raised when the mission cannot do now what a person did then; the text has the reason."""


class _WrongRecordError(ValueError):
    """Raised with what is wrong with a record."""


class LoggedCall(NamedTuple):
    """A call of the engine `at` a robot time [s]: what it read, which starts raised, which results had arrived.

    A tuple, since a log has many.
    """

    what: str
    at: float
    read: Mapping[str, Value] = _NOTHING
    raised: tuple[tuple[int, str, str], ...] = ()
    results: tuple[tuple[int, Result], ...] = ()
    inputs: Mapping[str, Value] = _NOTHING
    settings: Settings = PLAIN
    did: Intervention | None = None


class ReplayBudget:
    """Limits the work of replays, which is counted: a log may be made to take for ever."""

    def __init__(self, work: int = MOST_WORK) -> None:
        self.left = work

    def spend(self, work: int, record: int) -> None:
        """Count work; raise ReplayError if it is too much."""
        self.left -= work
        if self.left < 0:
            raise ReplayError("it takes too long to run again; replay a part of it", record)


class Played:
    """The world of a replay: it returns what was logged, and records the events."""

    def __init__(self) -> None:
        self.said: list[LogRecord] = []
        self.time = 0.0
        self._known: dict[str, Value] = {}
        self._raised: list[tuple[int, str, str]] = []

    def now_reads(self, call: LoggedCall) -> None:
        """Return these values from now on."""
        self.time = call.at
        self._raised = list(call.raised)
        if call.read:
            self._known.update(call.read)

    def value(self, name: str, /) -> Any:
        """Return the logged value."""
        return self._known[f"value {name}"]

    def age(self, name: str, /) -> Any:
        """Return the logged value."""
        return self._known[f"age {name}"]

    def count(self, name: str, /) -> Any:
        """Return the logged value."""
        return self._known[f"count {name}"]

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Raise the logged exception again, if there was one."""
        self._raise(leaf)

    def call(self, leaf: int, service: str, request: Mapping[str, Value], /) -> None:
        """Raise the logged exception again, if there was one."""
        self._raise(leaf)

    def publish(self, topic: str, message: Mapping[str, Value], /) -> None:
        """Raise the logged exception again, if there was one."""
        self._raise(0)

    def _raise(self, leaf: int) -> None:
        if self._raised and self._raised[0][0] == leaf:
            _, name, text = self._raised.pop(0)
            raise type(name, (Exception,), {})(text)

    def halt(self, leaf: int, /) -> None:
        """Do nothing: no request is under way."""

    def pause(self, leaf: int, /) -> None:
        """Do nothing: no request is under way."""

    def resume(self, leaf: int, /) -> None:
        """Do nothing: no request is under way."""

    def say(self, event: MissionEvent, /) -> None:
        """Record it."""
        self.said.append({"time": self.time, **record_of(event)})


class _Nobody:
    """Observes nothing; an engine with an observer counts its work."""

    def started(self, number: int, /) -> None:
        """Do nothing."""

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """Do nothing."""


def replay(
    records: Iterable[object], program: Program, robot: RobotNames, budget: ReplayBudget | None = None
) -> list[LogRecord]:
    """Replay a mission from its log and return its events, which are the same as then if nothing was changed.

    Raises:
        OtherMissionError: if they are the log of a mission that differs too much.
        ReplayError: if they do not begin with the beginning of a run, one is not as `LoggedWorld` writes it, or they
            take more than the budget.
    """
    budget = budget or ReplayBudget()
    world, engine = Played(), None
    for index, record in enumerate(records):
        try:
            call = _read(record)
        except (_WrongRecordError, UnreadableError, NoValue) as error:
            raise ReplayError(str(error), index) from error
        world.now_reads(call)
        work = _WORK_TO_READ
        if call.what == BEGIN:
            engine = Engine(program, robot, call.inputs, world, call.settings)
            work += _WORK_TO_BUILD * len(engine.statuses)
        elif engine is None:
            raise ReplayError("the log does not start with the start of the mission", index)
        elif call.what in INPUTS:
            before = engine.work
            _again(engine, call, index)
            work += engine.work - before + (len(engine.statuses) if call.did else 0)
        budget.spend(work, index)
    return world.said


def _again(engine: Engine, call: LoggedCall, index: int) -> None:
    for leaf, result in call.results:
        engine.ended(leaf, result)
    try:
        match call.what:
            case "tick":
                engine.tick(call.at)
            case "pause":
                engine.pause(call.at)
            case "resume":
                engine.resume(call.at)
            case "abort":
                engine.abort(call.at)
            case "restore":
                raise OtherInterventionError("it goes on from a snapshot, which the log does not hold", index)
            case "exchange":
                raise OtherInterventionError("the mission was changed while it ran", index)
            case "intervene" if call.did:
                engine.intervene(call.did, call.at)
    except NotPossible as error:
        raise OtherInterventionError(str(error), index) from error
    except KeyError as error:  # of a leaf, or of a value that was not read then
        raise OtherMissionError(f"the mission has no {error.args[0]}", index) from error


def _read(record: object) -> LoggedCall:
    """Return the call that a record describes; of a record of an event only the time counts.

    Raises:
        _WrongRecordError: if it is not a record of a log.
        NoValue: if it has a value that a log does not have.
    """
    entries = _map(record, "the record")
    what: object = entries.get("event")
    at: Any = entries.get("time")
    if not isinstance(what, str):
        raise _WrongRecordError("'event' is not a text")
    if type(at) not in (float, int) or not abs(at) < MOST:
        raise _WrongRecordError("'time' is not a time in seconds")
    if what == BEGIN:
        inputs = {name: from_plain(entry) for name, entry in _map(entries.get("inputs"), "'inputs'").items()}
        return LoggedCall(what, float(at), inputs=inputs, settings=_settings(entries))
    if what not in INPUTS or not ("read" in entries or "results" in entries or what == INTERVENE):
        return LoggedCall(what, float(at))
    read = dict(_map(entries.get("read", {}), "'read'"))
    raised = tuple(_raised(one) for one in _list(read.pop("raised", []), "'raised'"))
    values = {key: _known(key, from_plain(value)) for key, value in read.items()}
    results = tuple(_result(one) for one in _list(entries.get("results", []), "'results'"))
    did = _did(entries.get("did")) if what == INTERVENE else None
    return LoggedCall(what, float(at), values, raised, results, did=did)


def _did(plain: object) -> Intervention:
    """Return what a person did; raise UnreadableError or NoValue if it is nothing that people can do."""
    did = INTERVENTIONS.from_data(plain)
    return replace(did, value=from_plain(did.value)) if isinstance(did, ChangeData) else did


def _settings(entries: Mapping[str, Any]) -> Settings:
    seed = entries.get("seed")
    if type(seed) is not int:
        raise _WrongRecordError("'seed' is not a whole number")
    start_at = {}
    for number, state in _map(entries.get("start_at"), "'start_at'").items():
        if not (number.isascii() and number.isdecimal() and len(number) < 10 and isinstance(state, str)):
            raise _WrongRecordError("'start_at' does not lead from numbers of nodes to states")
        start_at[int(number)] = state
    return Settings(seed, start_at, _Nobody())


def _known(key: str, value: Value) -> Value:
    """Return a value that was read, which must be a number for an age, and a whole one for a count of messages."""
    what, _, name = key.partition(" ")
    is_fit = {"value": True, "age": value is NOT_ARRIVED or is_number(value), "count": type(value) is int}
    if not name or not is_fit.get(what):
        raise _WrongRecordError("'read' does not hold values, ages or counts of messages")
    return value


def _raised(plain: object) -> tuple[int, str, str]:
    match plain:
        case [int(leaf), str(name), str(text)]:
            return leaf, name, text
    raise _WrongRecordError("'raised' is not a list of the number of a node, the name of an error and a text")


def _result(plain: object) -> tuple[int, Result]:
    match plain:
        case [int(leaf), given]:
            result = from_plain(given)
            if isinstance(result, Result):
                return leaf, result
    raise _WrongRecordError("'results' is not a list of numbers of nodes, each with a result")


def _map(plain: object, what: str) -> dict[str, Any]:
    if not isinstance(plain, dict):
        raise _WrongRecordError(f"{what} is not a map")
    return plain


def _list(plain: object, what: str) -> list[Any]:
    if not isinstance(plain, list):
        raise _WrongRecordError(f"{what} is not a list")
    return plain
