"""Explores what could happen to a mission: every result of its skills, values on either side of each number."""

import json
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from itertools import pairwise
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.types import TypeKind
from rbxcompose.base.expressions.values import NOT_ARRIVED, NotArrived, Value, is_number
from rbxcompose.missions.analysis.facts import constants_of, number_in
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import MissionEnded, MissionEvent, Reported, SkillStarted
from rbxcompose.missions.engine.snapshot import restore, save
from rbxcompose.missions.engine.task import STILL_HOLDS, Task
from rbxcompose.missions.engine.world import POSE, show_briefly
from rbxcompose.missions.program.outcomes import IDLE, RUNNING, Result
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.tools.mission_tests.model import FAILS, SUCCEEDS, missions_in

MOST_PLACES = 3  # where the robot may be
BESIDE = 0.1  # distance of the outermost values from a limit, as a fraction of it
OTHER = "something else"  # a text that no comparison contains
WAITS_FOR_EVER = "the mission waits for ever: nothing runs, nothing is due, and no value can end the wait"
_DONE = {SUCCEEDS: "succeeds", FAILS: "fails"}


def representatives(linked: Program, robot: RobotNames, inputs: Mapping[str, Value]) -> dict[str, tuple[Value, ...]]:
    """Return values for each robot value that a mission reads; the largest number, or true, comes first."""
    compared: dict[str, set[Value]] = {}
    for program in missions_in(linked):
        constants = constants_of(program, inputs if program is linked else {})
        for _, asked in program.asked():
            for name, value in _compared(asked.expression, constants):
                compared.setdefault(name, set()).add(value)
    read = frozenset[str]().union(*(mission.reads for mission in missions_in(linked)))
    found = {name: _values(robot, name, compared.get(name, set())) for name in sorted(read & robot.values.keys())}
    if POSE in read and robot.places:
        found[POSE] = tuple(robot.places.values())[:MOST_PLACES]
    return found


def _values(robot: RobotNames, name: str, compared: set[Value]) -> tuple[Value, ...]:
    kind = robot.values[name]
    if kind.kind is TypeKind.FLAG:
        return (True, False)
    if kind.choices:
        return kind.choices
    words = tuple(sorted(value for value in compared if isinstance(value, str)))
    if words or kind.kind is TypeKind.TEXT:
        return (*words, OTHER)
    numbers = sorted(float(value) for value in compared if is_number(value))
    return _around(numbers) if numbers else (0.0,)


def _around(limits: Sequence[float]) -> tuple[float, ...]:
    """Return numbers above, between and below the limits, largest first."""
    width = max(abs(limit) for limit in limits) * BESIDE or BESIDE
    between = [(limit + other) / 2 for limit, other in pairwise(limits)]
    return tuple(sorted({limits[-1] + width, *between, limits[0] - width}, reverse=True))


def _compared(expression: syntax.Expression, constants: Mapping[str, Value]) -> Iterator[tuple[str, Value]]:
    """Yield each name that is compared with a constant, and the constant."""
    for part, _ in syntax.walk(expression.tree):
        if isinstance(part, syntax.Comparison):
            for one, other in ((part.left, part.right), (part.right, part.left)):
                value = _constant(other, constants)
                if isinstance(one, syntax.Variable) and value is not None:
                    yield one.name, value


def _constant(tree: syntax.ExpressionNode, constants: Mapping[str, Value]) -> Value:
    match tree:
        case syntax.Flag(value=flag):
            return flag
        case syntax.Text(value=text) | syntax.Word(name=text):
            return text
        case syntax.Minus(operand=operand):
            number = number_in(operand, constants)
            return None if number is None else -number
    return number_in(tree, constants)


@dataclass(frozen=True, slots=True)
class ExplorationLimits:
    """Limits of exploration: the total number of states, and of choices one after the other."""

    states: int = 2000
    depth: int = 30


USUAL_LIMITS = ExplorationLimits()


@dataclass(frozen=True, slots=True)
class Found:
    """A fault, in words, and the choices that lead to it."""

    what: str
    script: tuple[str, ...]


@dataclass(slots=True)
class Explored:
    """The result: the number of states, the ends with the shortest script to each, the faults."""

    mission: str
    states: int = 0
    deepest: int = 0
    is_cut: bool = False
    ends: dict[str, tuple[str, ...]] = field(default_factory=dict)
    found: list[Found] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class ExploredChoice:
    """One thing that may happen next: a call ends, time passes, a value changes."""

    text: str
    leaf: int = -1
    outcome: str = ""
    until: float | None = None  # [s]
    name: str = ""
    value: Value = None


@dataclass(frozen=True, slots=True)
class Moment:
    """A state of a mission: the engine's snapshot, None before the mission has begun, and the state of its world."""

    engine: dict[str, Any] | None
    now: float
    values: Mapping[str, Value]
    calls: Mapping[int, str]  # running calls, in words, by leaf
    held: Mapping[int, str]  # held calls
    script: tuple[str, ...] = ()


def explore(
    program: Program, robot: RobotNames, inputs: Mapping[str, Value], limits: ExplorationLimits = USUAL_LIMITS
) -> Explored:
    """Explore a mission that has no errors."""
    return Explorer(program, robot, inputs, limits).explore()


class Explorer:
    """Restores an engine to each moment, lets one more thing happen, and examines the result."""

    def __init__(
        self, program: Program, robot: RobotNames, inputs: Mapping[str, Value], limits: ExplorationLimits
    ) -> None:
        self.limits = limits
        self.robot = robot
        self.out = Explored(program.name)
        self.world = ExploredWorld()
        self.engine = Engine(program, robot, inputs, self.world)
        self.values = representatives(self.engine.program, robot, inputs)
        self.skills = {node.number: node.skill for node in self.engine.program.nodes}
        self.met: set[str] = set()
        self.said: set[str] = set()
        first = {name: values[0] for name, values in self.values.items()}
        self.waiting = deque([Moment(None, 0.0, first, {}, {})])
        self.fresh = save(self.engine)

    def explore(self) -> Explored:
        """Continue until there is nothing new or a limit is reached."""
        while self.waiting:
            moment = self.waiting.popleft()
            self.out.deepest = max(self.out.deepest, len(moment.script))
            if len(moment.script) >= self.limits.depth:
                self.out.is_cut = True
                continue
            for choice in self.choices(moment):
                if self.out.states >= self.limits.states:
                    self.out.is_cut = True
                    return self.out
                self.follow(moment, choice)
        return self.out

    def choices(self, moment: Moment) -> Iterator[ExploredChoice]:
        """Yield what may happen next."""
        if moment.engine is None:
            yield ExploredChoice("")
        for leaf, words in moment.calls.items():
            skill = self.robot.skills.get(self.skills[leaf])
            for outcome in (SUCCEEDS, FAILS, *(skill.outcomes if skill else ())):
                yield ExploredChoice(f"{words} {_DONE.get(outcome, f'ends {outcome}')}", leaf=leaf, outcome=outcome)
        wake = self.wake_of(moment)
        if wake is not None:
            yield ExploredChoice(f"{max(0.0, wake - moment.now):.3g} s pass", until=wake)
        for name, values in self.values.items():
            for value in values:
                if value != moment.values[name]:
                    words = show_briefly(self.robot.values.get(name), value)
                    yield ExploredChoice(f"{name} becomes {words}", name=name, value=value)

    def wake_of(self, moment: Moment) -> float | None:
        """Return when the mission wakes up by itself [s]."""
        if moment.engine is None:
            return None
        restore(self.engine, moment.engine)
        return self.engine.next_wake()

    def follow(self, moment: Moment, choice: ExploredChoice) -> None:
        """Let one thing happen, and keep the resulting moment if it is new."""
        engine, world = self.engine, self.world
        restore(engine, self.fresh if moment.engine is None else moment.engine)
        world.enter(moment)
        script = (*moment.script, choice.text) if choice.text else moment.script
        if choice.until is not None:
            world.now = max(moment.now, choice.until)
        if choice.name:
            world.set(choice.name, choice.value)
        if choice.leaf >= 0:
            del world.calls[choice.leaf]
            counts_as = self.counts_as(choice)
            own = "" if choice.outcome in _DONE else choice.outcome
            engine.ended(choice.leaf, Result(counts_as == SUCCEEDS, "", own))
        if moment.engine is None and choice.name:
            self.keep(Moment(None, 0.0, dict(world.values), {}, {}, script))
            return
        engine.tick(world.now)
        self.look(script)

    def counts_as(self, choice: ExploredChoice) -> str:
        """Return what the outcome of a call counts as."""
        skill = self.robot.skills.get(self.skills[choice.leaf])
        return (skill.outcomes if skill else {}).get(choice.outcome, choice.outcome)

    def look(self, script: tuple[str, ...]) -> None:
        """Report the faults at this moment, and keep it if the mission continues."""
        for text in self.world.reports:
            self.record(text, script)
        if self.engine.held_until is not None:
            self.out.states += 1
            return  # an endless loop, which was reported
        if self.engine.status not in (IDLE, RUNNING):
            self.out.states += 1
            if self.world.end:
                self.out.ends.setdefault(self.world.end.outcome or self.world.end.result, script)
            return
        world = self.world
        moment = Moment(save(self.engine), world.now, dict(world.values), dict(world.calls), dict(world.held), script)
        waits_for = self.engine.reads() & self.values.keys()
        if not moment.calls and self.engine.next_wake() is None and not waits_for:
            self.record(WAITS_FOR_EVER, script)
        self.keep(moment)

    def keep(self, moment: Moment) -> None:
        """Queue a moment, if it is new, to continue from it later."""
        mark = fingerprint(moment, self.engine.tasks)
        if mark not in self.met:
            self.met.add(mark)
            self.out.states += 1
            self.waiting.append(moment)

    def record(self, what: str, script: tuple[str, ...]) -> None:
        """Record a fault, with the first script that leads to it."""
        if what not in self.said:
            self.said.add(what)
            self.out.found.append(Found(what, script))


class ExploredWorld:
    """A world in which nothing happens by itself."""

    def __init__(self) -> None:
        self.now = 0.0
        self.values: dict[str, Value] = {}
        self.counts: dict[str, int] = {}
        self.calls: dict[int, str] = {}
        self.held: dict[int, str] = {}
        self.reports: list[str] = []
        self.end: MissionEnded | None = None

    def enter(self, moment: Moment) -> None:
        """Restore the world of a moment."""
        self.now = moment.now
        self.values, self.calls, self.held = dict(moment.values), dict(moment.calls), dict(moment.held)
        self.counts = dict.fromkeys(self.values, 1)
        self.reports, self.end = [], None

    def set(self, name: str, value: Value) -> None:
        """Receive a value."""
        self.values[name] = value
        self.counts[name] += 1

    def value(self, name: str, /) -> Value | NotArrived:
        """Return a value."""
        return self.values.get(name, NOT_ARRIVED)

    def age(self, name: str, /) -> float | NotArrived:
        """Return zero: every value has just arrived."""
        return 0.0 if name in self.values else NOT_ARRIVED

    def count(self, name: str, /) -> int:
        """Return how many values have arrived."""
        return self.counts.get(name, 0)

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Start a call."""
        self.calls.setdefault(leaf, skill)

    def halt(self, leaf: int, /) -> None:
        """Forget a call."""
        self.calls.pop(leaf, None)
        self.held.pop(leaf, None)

    def pause(self, leaf: int, /) -> None:
        """Hold a call, which then cannot end."""
        self.held[leaf] = self.calls.pop(leaf)

    def resume(self, leaf: int, /) -> None:
        """Let a call continue."""
        self.calls[leaf] = self.held.pop(leaf)

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Do nothing: there is no subscriber."""

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Start a call."""
        self.calls[leaf] = service

    def say(self, event: MissionEvent, /) -> None:
        """Record faults, and the texts of calls."""
        match event:
            case SkillStarted(leaf=leaf, text=text):
                self.calls[leaf] = text
            case Reported(place=place, message=message) if message != STILL_HOLDS:
                self.reports.append(f"{place}: {message}")
            case MissionEnded():
                self.end = event


def fingerprint(moment: Moment, tasks: Sequence[Task]) -> str:
    """Return a text that is equal for moments with the same possible futures: times are relative to now."""
    values = {name: str(value) for name, value in moment.values.items()}
    if moment.engine is None:
        return json.dumps(values, sort_keys=True)
    saved = moment.engine
    engine = [saved["engine"][name] for name in ("status", "is_paused", "draws")]
    states = [
        _state(task, state, moment.now, saved["statuses"][task.number] == RUNNING)
        for task, state in zip(tasks, saved["tasks"], strict=True)
    ]
    calls = sorted(moment.calls.items()), sorted(moment.held)
    kept = (saved["statuses"], engine, states, saved["runs"], saved["kept"], values, *calls)
    return json.dumps(kept, sort_keys=True)


def _state(task: Task, state: Sequence[Any], now: float, runs: bool) -> list[Any]:
    """Return the relevant part of a task's state; if it does not run, the leftovers of its latest run do not count."""
    counting = []
    for name, value in zip(("current", *task.saved), state, strict=True):
        is_time = name in task.times and isinstance(value, float)
        if name not in task.reported and (runs or name not in task.fresh):
            counting.append(round(value - now, 6) if is_time else value)
    return counting


def text_of(explored: Explored) -> str:
    """Return the result as text for people."""
    reach = "cut off at the limits" if explored.is_cut else "complete"
    lines = [f"{explored.mission}: {explored.states} states, {explored.deepest} choices deep; {reach}"]
    for end, script in sorted(explored.ends.items()):
        lines.append(f"  can end with {end}: {_script(script)}")
    for one in explored.found:
        lines.append(f"  WRONG: {one.what}")
        lines.append(f"         {_script(one.script)}")
    if not explored.found:
        lines.append("  nothing wrong was found")
    return "\n".join(lines)


def _script(script: tuple[str, ...]) -> str:
    return ", then ".join(script) if script else "at once"
