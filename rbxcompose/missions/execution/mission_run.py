"""One mission that runs: its engine with its world, its story, its log, and what viewers see."""

from __future__ import annotations

import json
import zlib
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import asdict
from functools import cached_property
from typing import Any, Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import NOT_ARRIVED, Value
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Refused
from rbxcompose.missions.analysis.examined import claims_of
from rbxcompose.missions.engine import logbook
from rbxcompose.missions.engine.debugger import named
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import Intervened, MissionEnded, MissionEvent, Transition
from rbxcompose.missions.engine.exchange import Exchanged, exchange
from rbxcompose.missions.engine.interventions import Intervention, SetBreakpoints
from rbxcompose.missions.engine.logbook import LoggedWorld, LogRecord
from rbxcompose.missions.engine.snapshot import carry_on, restore, save
from rbxcompose.missions.engine.story import MissionStory
from rbxcompose.missions.engine.world import PLAIN, POSE, Settings, World
from rbxcompose.missions.execution.world import RobotWorld
from rbxcompose.missions.program.outcomes import IDLE, NAMES, RUNNING, Result
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.view.picture import Drawn, heading_of, picture_of
from rbxcompose.missions.view.replica import Mirror
from rbxcompose.msgs.rbxcompose_msgs import RunMission
from rbxcompose.sdk.bound import ServedGoal

BLOCK = 200  # records that are packed together, into about a tenth of their memory
MOST_BLOCKS = 100


class LogStore:
    """Keeps the last `MOST_BLOCKS` blocks of records, so that a long patrol takes no more memory than a short one."""

    def __init__(self) -> None:
        self.written = 0  # records so far
        self._packed: deque[bytes] = deque(maxlen=MOST_BLOCKS)
        self._new: list[LogRecord] = []

    def append(self, record: LogRecord) -> None:
        """Add a record, which is data for JSON."""
        self.written += 1
        self._new.append(record)
        if len(self._new) == BLOCK:
            self._packed.append(zlib.compress(json.dumps(self._new).encode()))
            self._new = []

    def since(self, number: int) -> list[LogRecord]:
        """Return the records after the first `number`, as far as they are kept."""
        first = self.written - len(self._new) - BLOCK * len(self._packed)
        return [record for at, record in enumerate(self._all(max(0, number - first) // BLOCK), first) if at >= number]

    def _all(self, skipped: int) -> Iterator[LogRecord]:
        """Yield all records; the first `skipped` blocks are not decompressed, and yield empty ones."""
        for at, block in enumerate(self._packed):
            yield from ({} for _ in range(BLOCK)) if at < skipped else json.loads(zlib.decompress(block))
        yield from self._new


PATIENCE = 60.0  # [s] between warnings while a mission waits for its first values
ROUNDING = 1e-6  # [s]
LAST = 20  # transitions that viewers get

MakeWorld = Callable[[Callable[[int, Result], None], Callable[[MissionEvent], None]], tuple[World, RobotWorld]]
OnLine = Callable[[Level, str], None]


@dataclass(frozen=True, slots=True)
class LeftMission:
    """Where a mission was when its executive was replaced; `began` is in robot time [s]."""

    name: str
    program: Program
    names: RobotNames
    inputs: Mapping[str, Value]
    began: float
    state: Mapping[str, Any]

    def inputs_for(self, program: Program) -> Mapping[str, Value]:
        """Return those of its inputs that a changed mission has as well."""
        return common_inputs(self.inputs, self.program, program)


def common_inputs(inputs: Mapping[str, Value], old: Program, new: Program) -> Mapping[str, Value]:
    """Return the inputs that two versions of a mission have with the same type."""
    same = {
        name for name, declared in new.inputs.items() if name in old.inputs and old.inputs[name].type == declared.type
    }
    return {name: value for name, value in inputs.items() if name in same}


class MissionRun:
    """Runs a mission, with time as an argument; `on_line` takes the lines of its story, `write` its log's records."""

    def __init__(
        self,
        program: Program,
        names: RobotNames,
        inputs: Mapping[str, Value],
        make: MakeWorld,
        on_line: OnLine,
        write: logbook.Write,
        *,
        name: str,
        settings: Settings = PLAIN,
    ) -> None:
        self.name = name
        self.is_paused = False
        self.end: MissionEnded | None = None
        self.began: float | None = None  # [s] of robot time
        self.patient_until: float | None = None  # [s] of the next warning while it waits for its first values
        self.story = MissionStory(name, self.heading)
        self.by_hand = 0  # what people did to it: it cannot be reproduced without that
        self.transitions: deque[dict[str, Any]] = deque(maxlen=LAST)
        self.breakpoints = SetBreakpoints()
        self.edition = 0  # how often it was changed while it ran
        self.goes_on = False  # it was restored, and is resumed when every value that it reads has arrived
        self._on_line, self._now = on_line, 0.0
        world, self.robot = make(self._ended, self._said)
        self.log = LoggedWorld(world, lambda record: write(self._placed(record)))
        self.engine = Engine(program, names, inputs, self.log, settings)
        self.claims = claims_of(self.engine.program, self.engine.robot)  # parts of the robot, exclusively
        self.mirror = Mirror(self.engine)
        self._states = (names.values.keys() | {POSE}) - names.events
        self._inputs, self._settings = inputs, settings

    def _placed(self, record: LogRecord) -> LogRecord:
        """Return a record with time and mission; one of a node has its sentence, too: `1.2 Go to dock`."""
        number = record.get("leaf", record.get("node"))
        step = {} if number is None else {"step": self._sentences[number]}
        return {"time": self._now, "mission": self.name, **record, **step}

    @cached_property
    def _drawn(self) -> Mapping[int, Drawn]:
        picture = picture_of(self.engine.program, self.engine.robot)
        drawn = (one for root in picture.roots for one in root.all())
        return {one.number: one for one in drawn if one.number is not None}

    @cached_property
    def _sentences(self) -> Mapping[int, str]:
        return {number: f"{one.place} {one.sentence}" for number, one in self._drawn.items()}

    def heading(self, number: int) -> str:
        """Return how the story names a node: as `mission show` does."""
        return heading_of(self._drawn[number], self.engine.program.nodes[number])

    @property
    def is_over(self) -> bool:
        """Return whether it has ended, by itself or not."""
        return self.end is not None

    @property
    def state(self) -> str:
        """Return its state as a word."""
        if self.end is not None:
            return self.end.outcome or self.end.result
        if self.is_paused:
            return "paused"
        return "waiting" if self.engine.status == IDLE else NAMES[self.engine.status]

    def missing(self) -> list[str]:
        """Return the names that it reads and that have no value yet; it does not wait for events."""
        reads = self.engine.program.reads & self._states
        return sorted(name for name in reads if self.robot.value(name) is NOT_ARRIVED)

    def loses_patience(self, now: float) -> bool:
        """Return whether another `PATIENCE` has passed while it waits for its first values."""
        if self.patient_until is None:
            self.patient_until = now + PATIENCE
        if now < self.patient_until - ROUNDING:
            return False
        self.patient_until = now + PATIENCE
        return True

    def reads(self, name: str) -> bool:
        """Return whether a new value of this name is worth a tick."""
        is_waiting = self.engine.status == IDLE or self.goes_on
        return not self.is_over and (is_waiting or name in self.engine.reads())

    def tick(self, now: float) -> None:
        """Do what is due at `now` [s]."""
        self._now = now
        if self.began is None:
            self.began = now
            self.log.begin(self._inputs, self._settings)
            if self.breakpoints != SetBreakpoints():
                self.intervene(self.breakpoints, now)
        self.robot.look()
        self._do(logbook.TICK, lambda: self.engine.tick(now), now)
        if self.engine.stops and not self.is_over:
            self.pause(now)

    def restore(self, state: Mapping[str, Any], now: float) -> None:
        """Go on from a snapshot, of this process or another one; it is paused then.

        Raises:
            NoSnapshot: if it is none of this mission.
        """
        self._now = self.began = now
        self.log.begin(self._inputs, self._settings)
        restore(self.engine, state)
        self._do(logbook.RESTORE, lambda: carry_on(self.engine), now)
        self.is_paused = True
        if self.breakpoints != SetBreakpoints():
            self.intervene(self.breakpoints, now)

    def exchanged(self, program: Program, names: RobotNames, inputs: Mapping[str, Value]) -> tuple[Engine, Exchanged]:
        """Return an engine that goes on with a changed mission where this one is, and what comes of that.

        The robot notices nothing so far.

        Raises:
            NotPossible: if something that runs cannot go on.
        """
        engine = Engine(program, names, inputs, self.log, self._settings)
        return engine, Exchanged() if self.engine.status == IDLE else exchange(self.engine, engine)

    def inputs_for(self, program: Program) -> Mapping[str, Value]:
        """Return those of its inputs that a changed mission has as well."""
        return common_inputs(self._inputs, self.engine.program, program)

    @property
    def left(self) -> LeftMission:
        """Return what another executive needs to go on with it."""
        began = self._now if self.began is None else self.began
        return LeftMission(self.name, self.engine.program, self.engine.robot, self._inputs, began, save(self.engine))

    def take_up(self, left: LeftMission, now: float) -> None:
        """Be where another executive has left this mission, paused; what it requested is requested again.

        Raises:
            NotPossible: if something that ran cannot go on.
        """
        self._now, self.began, self.is_paused = now, left.began, True
        before = Engine(left.program, left.names, left.inputs, self.log, self._settings)
        restore(before, left.state)
        carry_on(before)
        found = exchange(before, self.engine)
        self.log.begin(self._inputs, self._settings)
        self._changed(found, self.breakpoints, now)

    def go_on_as(self, engine: Engine, found: Exchanged, breakpoints: SetBreakpoints, now: float) -> None:
        """Go on with what `exchanged` returned; requests of leaves that begin again are stopped."""
        self._now = now
        for leaf in found.halted:
            self.engine.stop_request(leaf, "the mission was changed", now)
        self.robot.renumber(found.requests)
        self.story.renumber(found.nodes)
        self.engine, self._inputs = engine, engine.inputs
        self.claims = claims_of(engine.program, engine.robot)
        self.mirror = Mirror(engine, self.mirror.version)
        self._states = (engine.robot.values.keys() | {POSE}) - engine.robot.events
        for cached in ("_drawn", "_sentences"):
            self.__dict__.pop(cached, None)
        self.edition += 1
        if self.began is not None:
            self._changed(found, breakpoints, now)

    def _changed(self, found: Exchanged, breakpoints: SetBreakpoints, now: float) -> None:
        self.log.did(logbook.EXCHANGE)
        self.log.say(Intervened("; ".join(("the robot's missions were changed", *found.notes))))
        self.stop_at(breakpoints, now)

    def next_wake(self) -> float | None:
        """Return when to tick it next [s]."""
        if self.is_over:
            return None
        due = (self.engine.next_wake(), self.robot.next_look())
        return min((time for time in due if time is not None), default=None)

    def look(self, now: float) -> None:
        """Poll the requests that go on while it is paused."""
        self._now = now
        self.robot.look()

    def pause(self, now: float) -> None:
        """Pause it: its timers stop."""
        self.is_paused, self.goes_on = True, False
        self._do(logbook.PAUSE, lambda: self.engine.pause(now), now)

    def resume(self, now: float) -> None:
        """Continue."""
        self.is_paused = self.goes_on = False
        self._do(logbook.RESUME, lambda: self.engine.resume(now), now)

    def stop_at(self, breakpoints: SetBreakpoints, now: float) -> None:
        """Stop at these breakpoints from now on, and at no others."""
        self.breakpoints = breakpoints
        if self.began is not None and not self.is_over:
            self.intervene(breakpoints, now)

    def intervene(self, intervention: Intervention, now: float) -> None:
        """Do what a person wants; raise `NotPossible` if that cannot be done."""
        self._do(logbook.INTERVENE, lambda: self.engine.intervene(intervention, now), now, intervention)

    @property
    def stopped_at(self) -> list[dict[str, Any]]:
        """Return the nodes at which a breakpoint or a step has stopped it: number, file and line, and what it is.

        `after` is the outcome with which a state was left; it is empty before the start of a node.
        """
        nodes, after = self.engine.program.nodes, self.engine.debugger.outcomes()
        stops = () if self.is_over else self.engine.stops
        return [
            {"node": at, "place": nodes[at].span.place, "text": named(nodes[at]), "after": after.get(at, "")}
            for at in stops
        ]

    def abort(self, now: float) -> None:
        """End it from outside."""
        if self.engine.status == RUNNING:
            self._do(logbook.ABORT, lambda: self.engine.abort(now), now)
        elif not self.is_over:
            self._now = now
            self._said(MissionEnded("halted"))

    def seen(self, since: int = 0) -> dict[str, Any]:
        """Return what has changed since the version that a viewer has; 0 gives the full state."""
        run = {"mission": self.name, "state": self.state, "began": self.began, "edition": self.edition}
        told = {"transitions": list(self.transitions), "stopped_at": self.stopped_at, "by_hand": self.by_hand}
        return {**run, **self.mirror.look(since), **told}

    def _do(self, what: str, call: Callable[[], object], now: float, intervention: Intervention | None = None) -> None:
        """Call the engine, and log what it read during the call."""
        self._now = now
        call()
        self.log.did(what, intervention)

    def _ended(self, leaf: int, result: Result) -> None:
        self.log.arrived(leaf, result)
        self.engine.ended(leaf, result)

    def _said(self, event: MissionEvent) -> None:
        level, text = self.story.line(event)
        if isinstance(event, MissionEnded):
            self.end = event
        if isinstance(event, Intervened):
            self.by_hand += 1
        if isinstance(event, Transition):
            self.transitions.append({"time": self._now, **asdict(event)})
        if text:
            self._on_line(level, text)


Order = ServedGoal[RunMission.Goal, RunMission.Result, RunMission.Feedback]


class Begins(Protocol):
    """Begins a mission with inputs as text, and parts of the robot that are lent to it."""

    def __call__(self, name: str, inputs: Mapping[str, str], *, lent: frozenset[str]) -> MissionRun:
        """Begin it.

        Raises:
            Refused: if it cannot run, with the reason.
        """


class OrderedMission:
    """Runs one mission at a time for other components; the newest goal counts."""

    def __init__(
        self, inputs_of: Callable[[str], Collection[str]], begin: Begins, end: Callable[[MissionRun], None]
    ) -> None:
        self._inputs_of, self._begin_mission, self._end_mission = inputs_of, begin, end
        self._goal: Order | None = None
        self._run: MissionRun | None = None

    def step(self, goal: Order | None) -> None:
        """Begin what is wanted now, and report how it ended."""
        if goal is not self._goal:
            self._leave()
            self._goal = goal
            if goal is not None:
                self._begin(goal)
        if goal is None or self._run is None:
            return
        if goal.cancel_requested:
            self._leave()
            goal.canceled()
        elif (end := self._run.end) is not None:
            self._run = None
            told = RunMission.Result(end.words or end.result)
            if end.result == "success":
                goal.succeeded(told)
            else:
                goal.aborted(told.message, told)

    def _begin(self, goal: Order) -> None:
        request, known = goal.request, self._inputs_of(goal.request.mission)
        given = {name: text for name, text in zip(request.inputs, request.values, strict=False) if name in known}
        try:
            self._run = self._begin_mission(request.mission, given, lent=frozenset(request.lends))
        except Refused as refusal:
            goal.aborted(str(refusal), RunMission.Result(str(refusal)))

    def _leave(self) -> None:
        """End the mission of a goal that nobody wants any more."""
        if self._run is not None and not self._run.is_over:
            self._end_mission(self._run)
        self._run = None
