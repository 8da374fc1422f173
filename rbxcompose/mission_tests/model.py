"""A test of a mission after reading: all names are known, values have their types."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.values import Scope, Value
from rbxcompose.findings import Span
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.program.statuses import FAILURE, NAMES, RUNNING, SUCCESS
from rbxcompose.msgs.types import Message
from rbxcompose.plan.model import Plan
from rbxcompose.requests import Command

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
        if call in self.fails_at or any(same(one, argument) for one in self.fails_for):
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
    about: str
    file: str  # as shown in findings
    span: Span
    mission: str
    program: Program
    linked: Program
    names: RobotNames
    plan: Plan
    inputs: Mapping[str, Value]
    mocks: Mapping[str, Mock]
    events: tuple[TrialEvent, ...]
    expect: Expectations
    is_complete: bool
