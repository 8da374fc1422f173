"""All missions of a robot: which run, which may start beside them, and what viewers see."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any, NamedTuple

from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Query, Refused
from rbxcompose.missions.analysis.examined import claims_of
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.exchange import Exchanged
from rbxcompose.missions.engine.inputs import NoSuchState, bind_texts, start_at
from rbxcompose.missions.engine.interventions import NotPossible
from rbxcompose.missions.engine.logbook import LogRecord
from rbxcompose.missions.engine.snapshot import from_plain
from rbxcompose.missions.engine.world import PLAIN, Observer, Settings, show
from rbxcompose.missions.execution import requests
from rbxcompose.missions.execution.breakpoints import Breakpoints
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.mission_run import LeftMission, LogStore, MakeWorld, MissionRun
from rbxcompose.missions.execution.snapshots import differences, identity_of
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.outcomes import IDLE, NAMES
from rbxcompose.missions.program.parts import Input
from rbxcompose.missions.program.program import Program
from rbxcompose.missions.view.picture import picture_of, picture_to_data
from rbxcompose.sdk.bound import Window

OnLine = Callable[[str, Level, str], None]  # mission, level, line of its story


class Followed(NamedTuple):
    """How a mission that runs would go on with what has changed."""

    run: MissionRun
    engine: Engine
    exchanged: Exchanged


class RunningMissions:
    """The running missions, in the order in which they began, and ended ones until they run again."""

    def __init__(
        self, equipment: MissionConfig, make: MakeWorld, on_line: OnLine, publish: Callable[[LogRecord], None]
    ) -> None:
        self._equipment, self.make, self._on_line, self._publish = equipment, make, on_line, publish
        self.observer: Observer | None = None  # of all that begin from now on
        self.runs: dict[str, MissionRun] = {}
        self._log = LogStore()
        self._counts: dict[str, int] = {}
        self.breakpoints = Breakpoints(equipment)

    def __iter__(self) -> Iterator[MissionRun]:
        """Return the missions that run or are paused."""
        return (run for run in list(self.runs.values()) if not run.is_over)

    @property
    def names(self) -> list[str]:
        """Return the names of the missions that run or are paused."""
        return [run.name for run in self]

    def run(
        self, name: str, given: Mapping[str, str], start: str = "", lent: frozenset[str] = frozenset()
    ) -> MissionRun:
        """Start a mission with these inputs, as text, in the state `start` of its machines if one is named.

        It may use the parts of the robot that are `lent`, though a running mission needs them.

        Raises:
            Refused: if there is none, an input does not fit, or a running mission needs the same part of the robot.
        """
        program = self._program(name)
        if name in self.names:
            raise Refused(f"mission {name} is already running")
        inputs = self._inputs(name, program, given)
        linked = link(program, self._equipment.names.missions)
        if clash := self._clash(linked, lent):
            raise Refused(clash)
        try:
            settings = Settings(start_at=start_at(linked, start) if start else {}, observer=self.observer)
        except NoSuchState as error:
            raise Refused(str(error)) from error
        return self._made(name, program, inputs, settings)

    def resumed(self, name: str, snapshot: Mapping[str, Any], now: float) -> MissionRun:
        """Restore a mission from its snapshot; it is paused.

        Raises:
            Refused: if mission or robot have changed, it runs, or a running mission needs the same part of the robot.
        """
        program = self._program(name)
        if name in self.names:
            raise Refused(f"mission {name} is running: cancel it first")
        linked = link(program, self._equipment.names.missions)
        if changed := self.changed_since(name, snapshot):
            raise Refused(f"mission {name} cannot go on from its snapshot: {changed} changed since")
        if clash := self._clash(linked, frozenset()):
            raise Refused(clash)
        run = self._made(name, program, from_plain(snapshot["state"]["runs"][0]["inputs"]), PLAIN)
        run.restore(snapshot["state"], now)
        return run

    def changed_since(self, name: str, snapshot: Mapping[str, Any]) -> str:
        """Return in words what has changed since the snapshot of a mission; empty if it can go on."""
        return differences(snapshot["identity"], identity_of(self.breakpoints.linked(name), self._equipment.names))

    # Other missions and places

    def followed(self, equipment: MissionConfig) -> list[Followed]:
        """Return how the missions that run would go on with what has changed; nothing is done so far.

        Raises:
            Refused: if one of them cannot go on, with the reason.
        """
        found = [followed for run in self if (followed := self._followed(run, equipment)) is not None]
        claims = {run.name: run.claims for run in self}
        now = {**claims, **{one.run.name: claims_of(one.engine.program, equipment.names) for one in found}}
        for name, other in combinations(claims, 2):
            if common := sorted((now[name] & now[other]) - (claims[name] & claims[other])):
                raise Refused(f"missions {name} and {other} run, and both would use {' and '.join(common)}")
        return found

    def _followed(self, run: MissionRun, equipment: MissionConfig) -> Followed | None:
        """Return how a mission would go on; None if nothing changes for it."""
        program = equipment.names.missions.get(run.name)
        if program is None:
            raise Refused(f"mission {run.name} runs, and would be gone: cancel it first")
        linked = link(program, equipment.names.missions)
        if linked == run.engine.program and equipment.names == run.engine.robot:
            return None
        known = {**equipment.inputs.get(run.name, {}), **run.inputs_for(program)}
        inputs, findings = bind_texts(program, {}, known, equipment.names.places)
        if findings:
            raise Refused(f"mission {run.name} runs: {findings[0].message}")
        try:
            return Followed(run, *run.exchanged(linked, equipment.names, inputs))
        except NotPossible as error:
            raise Refused(f"mission {run.name} cannot go on: {error}") from error

    def follow(self, equipment: MissionConfig, found: Iterable[Followed], now: float) -> tuple[str, ...]:
        """Go on as `followed` has found; return the breakpoints that are gone."""
        gone = self.breakpoints.follow(equipment)
        self._equipment = equipment
        for run, engine, exchanged in found:
            run.go_on_as(engine, exchanged, self.breakpoints.of(run.name), now)
        return gone

    def taken_over(self, left: LeftMission, now: float) -> MissionRun:
        """Return a mission that another executive has left, which was paused; it still is.

        Raises:
            Refused: if it cannot go on with what has changed.
        """
        program, name = self._equipment.names.missions.get(left.name), left.name
        if program is None:
            raise Refused(f"mission {name} is gone")
        inputs = bind_texts(program, {}, self._equipment.inputs.get(name, {}), self._equipment.names.places)[0]
        run = self._made(name, program, {**inputs, **left.inputs_for(program)}, PLAIN)
        try:
            run.take_up(left, now)
        except NotPossible as error:
            del self.runs[name]
            raise Refused(f"mission {name} cannot go on: {error}") from error
        return run

    def _made(self, name: str, program: Program, inputs: Mapping[str, Value], settings: Settings) -> MissionRun:
        self._counts[name] = self._counts.get(name, 0) + 1
        number = self._counts[name]
        self.runs.pop(name, None)
        self.runs[name] = MissionRun(
            program,
            self._equipment.names,
            inputs,
            self.make,
            lambda level, text: self._on_line(name, level, text),
            lambda record: self._write({**record, "run": number}),
            name=name,
            settings=settings,
        )
        self.runs[name].breakpoints = self.breakpoints.of(name)
        return self.runs[name]

    def seen(self, name: str, since: int = 0) -> requests.Seen:
        """Return what has changed in a mission since the version that a viewer has; 0 gives the full state.

        Raises:
            Refused: if it has not been running.
        """
        return self._begun(name).seen(since)

    def shown(self, name: str) -> dict[str, str]:
        """Return the data of a mission as text for people.

        Raises:
            Refused: if it has not been running.
        """
        main = self._begun(name).engine.main
        return {name: main.show(name, value) for name, value in main.data.items()}

    def picture(self, name: str) -> requests.PictureData:
        """Return the picture of a mission, as data; of one that has not been running, as it would run.

        Raises:
            Refused: if there is none.
        """
        run = self.runs.get(name)
        if run is not None:
            return _picture(run.engine)
        return picture_to_data(picture_of(self._program(name), self._equipment.names))

    def running(
        self, name: str, what: Callable[[MissionRun], bool] = lambda one: True, word: str = "running"
    ) -> MissionRun:
        """Return the mission of this name; without a name, the only one for which `what` holds.

        Raises:
            Refused: if it does not run, or it is not clear which one is meant.
        """
        if name:
            if name not in self.names:
                self._program(name)
                raise Refused(f"mission {name} is not running")
            return self.runs[name]
        found = [run for run in self if what(run)]
        if len(found) == 1:
            return found[0]
        if not found:
            only = list(self)
            if len(only) == 1:
                return only[0]
            raise Refused(f"no mission is {word}")
        raise Refused(f"several missions are {word}: {', '.join(run.name for run in found)}; name one")

    def listed(self) -> tuple[requests.ListedMission, ...]:
        """Return all missions of the robot with their states."""
        return tuple(self._listed(name, program) for name, program in self._equipment.programs.items())

    def _listed(self, name: str, program: Program) -> requests.ListedMission:
        run, names = self.runs.get(name), self._equipment.names
        claims = sorted(claims_of(program, names)) if name in names.missions else []
        inputs = tuple(map(_listed_input, program.inputs.values()))
        states = program.nodes[program.main].step.states
        starts = states.names if states else ()
        at = ", ".join(stop["place"] for stop in run.stopped_at) if run else ""
        return requests.ListedMission(
            name, program.about, run.state if run else NAMES[IDLE], tuple(claims), inputs, starts, at
        )

    def since(self, number: int) -> requests.LogPart:
        """Return the records of the log after the first `number`."""
        return requests.LogPart(self._log.written, self._log.since(number))

    def _begun(self, name: str) -> MissionRun:
        if name not in self.runs:
            raise Refused(f"mission {name} has not been running")
        return self.runs[name]

    def _program(self, name: str) -> Program:
        programs = self._equipment.programs
        if name not in programs:
            raise Refused(clauses(f"the robot has no mission '{name}'", suggest(name, programs, "its missions")))
        return programs[name]

    def _inputs(self, name: str, program: Program, given: Mapping[str, str]) -> Mapping[str, Value]:
        """Return the robot's inputs for a mission, overridden by those that were given."""
        known = self._equipment.inputs.get(name, {})
        inputs, findings = bind_texts(program, given, known, self._equipment.names.places)
        if findings:
            raise Refused("; ".join(finding.message for finding in findings))
        return inputs

    def _clash(self, linked: Program, lent: frozenset[str]) -> str:
        """Return why a mission cannot run beside the running ones; empty if it can."""
        for other, common in self._clashes(linked, lent):
            return f"{' and '.join(common)} {'is' if len(common) == 1 else 'are'} in use by {other.name}"
        return ""

    def _clashes(self, linked: Program, lent: frozenset[str]) -> Iterator[tuple[MissionRun, list[str]]]:
        """Yield the running missions that need parts of the robot that a mission needs as well, each with these."""
        wanted = claims_of(linked, self._equipment.names) - lent
        for other in self:
            if common := sorted(wanted & other.claims):
                yield other, common

    def in_the_way(self, name: str) -> list[str]:
        """Return the running missions beside which a mission cannot start, itself included if it runs."""
        linked = link(self._program(name), self._equipment.names.missions)
        clashing = [other.name for other, _ in self._clashes(linked, frozenset())]
        return list(dict.fromkeys([*([name] if name in self.names else []), *clashing]))

    def _write(self, record: LogRecord) -> None:
        self._log.append(record)
        self._publish(record)


PATH = "missions"
_TOLD = "version", "state", "transitions", "began", "stopped_at", "by_hand"  # what is news
_ALWAYS = frozenset({"mission", "version", "whole", "state"})  # what is in all updates

Open = Callable[[str, Query[Any]], Window]  # takes a path and the query that is made there


class Broadcast:
    """A window for each mission of a robot."""

    def __init__(self, names: Iterable[str], open_window: Open) -> None:
        self._list = open_window(PATH, requests.ListMissions())
        self._open, self._feeds = open_window, dict[str, MissionFeed]()
        self.follow(names)

    def follow(self, names: Iterable[str]) -> None:
        """Open windows for missions that have none yet."""
        for name in names:
            if name not in self._feeds:
                self._feeds[name] = MissionFeed(self._open(f"{PATH}/{name}", requests.LookAtAll(name)))

    def publish(self, missions: RunningMissions) -> None:
        """Publish what has changed; nothing is prepared without a viewer."""
        for name, run in missions.runs.items():
            self._feeds[name].publish(run)


class MissionFeed:
    """What was last published about one mission."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._run: tuple[MissionRun, int] | None = None  # with its edition
        self._program: Program | None = None  # of which viewers have the picture
        self._published: dict[str, Any] = {}

    def publish(self, run: MissionRun) -> None:
        """Send what is new, if there is a subscriber and something new."""
        if not self._window.is_watched:
            return
        if (run, run.edition) != self._run:
            self._run, self._published = (run, run.edition), {}
        seen = run.seen(self._published.get("version", 0))
        if run.engine.program is not self._program:  # a viewer that stays has the picture of another one
            self._program, seen = run.engine.program, {**seen, "picture": _picture(run.engine)}
        fresh = {key: value for key, value in seen.items() if key in _ALWAYS or self._published.get(key) != value}
        fresh |= {"statuses": seen["statuses"], "data": seen["data"]}
        if all(self._published.get(key) == seen[key] for key in _TOLD):
            return
        self._published = seen
        self._window.put(fresh)


def _picture(engine: Engine) -> requests.PictureData:
    return picture_to_data(picture_of(engine.program, engine.robot))


def _listed_input(given: Input) -> requests.ListedInput:
    choices = ("false", "true") if given.type == FLAG else given.type.choices
    return requests.ListedInput(
        given.name, given.type.detail, choices, None if given.default is None else show(given.type, given.default.value)
    )
