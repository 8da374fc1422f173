"""A test of a mission after reading: all names are known, values have their types."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import Scope, Value
from rbxcompose.base.findings import Span
from rbxcompose.base.requests import Command
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.missions.analysis.examined import Ending
from rbxcompose.missions.analysis.facts import sent_by
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.program.outcomes import FAILURE, NAMES, RUNNING, SUCCESS
from rbxcompose.missions.program.program import Program, RobotNames, Skill
from rbxcompose.msgs.types import Message

SUCCEEDS, FAILS, RUNS = NAMES[SUCCESS], NAMES[FAILURE], NAMES[RUNNING]
HALTED, SKIPPED = "halted", "skipped"

ValueSetting = Callable[[Scope], Value]
"""Computes the value that a test gives to a name."""


@dataclass(frozen=True, slots=True)
class Mock:
    """How a test answers for a skill or a service.

    `main` is the argument that `fails_for` refers to; `outcomes` says what each outcome counts as.
    """

    name: str
    span: Span
    takes: float = 0.0  # [s]
    result: str = SUCCEEDS
    message: str = ""
    sets: Mapping[str, ValueSetting] = field(default_factory=dict)
    fails_at: frozenset[int] = frozenset()
    fails_for: tuple[Value, ...] = ()
    outcome_at: Mapping[int, str] = field(default_factory=dict)
    main: str = ""
    outcomes: Mapping[str, str] = field(default_factory=dict)

    def outcome(self, call: int, argument: Value, same: Callable[[Value, Value], bool]) -> str:
        """Return how a call ends; `call` counts from 1."""
        if call in self.outcome_at:
            return self.outcome_at[call]
        if call in self.fails_at or any(same(value, argument) for value in self.fails_for):
            return FAILS
        return self.result


@dataclass(frozen=True, slots=True)
class EventDeed:
    """One action of an event: a word of the file, with its values; a `request` is sent to a component."""

    word: str
    settings: Mapping[str, ValueSetting] = field(default_factory=dict)
    topic: str = ""
    message: Message | None = None
    component: str = ""
    request: Command | None = None


@dataclass(frozen=True, slots=True)
class TrialEvent:
    """What happens to the robot at a time [s]."""

    at: float
    deeds: tuple[EventDeed, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class ExpectedStep:
    """An expected step: a call of a skill, a named node or a state.

    `counts_as` says what each possible outcome of this step counts as.
    """

    name: str
    span: Span
    arguments: Mapping[str, Value] = field(default_factory=dict)
    ended: str = ""
    at: float | None = None  # [s]
    text: str = ""
    counts_as: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ExpectedMessage:
    """An expected message: a topic, and the fields to compare."""

    topic: str
    fields: Mapping[str, Value]
    span: Span


@dataclass(frozen=True, slots=True)
class ExpectedValue:
    """A value expected under a name, with its place."""

    name: str
    value: Value
    span: Span


@dataclass(frozen=True, slots=True)
class Expectations:
    """What must have happened; at `until` [s] the test ends even if the mission has not."""

    outcome: str = ""
    outcome_span: Span | None = None
    until: float | None = None
    steps: tuple[ExpectedStep, ...] = ()
    never: tuple[ExpectedStep, ...] = ()
    count: tuple[ExpectedValue, ...] = ()
    data: tuple[ExpectedValue, ...] = ()
    published: tuple[ExpectedMessage, ...] = ()
    reports: tuple[ExpectedValue, ...] = ()


@dataclass(frozen=True, slots=True)
class Trial:
    """A test of a mission on a robot, ready to run; `linked` is the program with all missions that it uses.

    `is_complete` means that the test answers everything the mission needs from the robot, so that no robot is needed.
    """

    name: str
    mission: str
    program: Program
    linked: Program
    robot: Robot
    plan: Plan
    inputs: Mapping[str, Value]
    mocks: Mapping[str, Mock]
    events: tuple[TrialEvent, ...]
    expect: Expectations
    is_complete: bool

    @property
    def names(self) -> RobotNames:
        """Return the names that the robot gives to its missions."""
        return self.robot.names


def missions_in(program: Program) -> Iterator[Program]:
    """Yield a linked mission and each mission that it uses, once per use."""
    yield program
    yield from (node.inner for node in program.nodes if node.inner)


@dataclass(frozen=True, slots=True)
class MissionFacts:
    """What a mission needs from the robot, and its steps by name, each with what its outcomes count as."""

    skills: Mapping[str, Skill]
    services: frozenset[str]
    values: frozenset[str]
    topics: frozenset[str]
    steps: Mapping[str, Mapping[str, str]]
    ends: Mapping[str, str]

    @classmethod
    def of(cls, program: Program, robot: RobotNames) -> MissionFacts:
        """Return the facts of a linked mission."""
        named: dict[str, Mapping[str, str]] = {}
        for node in program.nodes:
            if node.name:
                own = Ending(program, robot).of(node.number).named
                named[node.name] = {**named.get(node.name, {}), **own}
        skills = {node.skill: robot.skills[node.skill] for node in program.nodes if node.skill in robot.skills}
        published, called = sent_by([program])
        read = frozenset[str]().union(*(mission.reads for mission in missions_in(program)))
        return cls(
            skills,
            frozenset(called),
            read & {*robot.values, POSE} - {*program.inputs, *program.data},
            frozenset(published),
            {**named, **{name: skill.outcomes for name, skill in skills.items()}},
            {SUCCEEDS: SUCCEEDS, FAILS: FAILS, **Ending(program, robot).mission().named},
        )
