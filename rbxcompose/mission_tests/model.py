"""A test of a mission that was read: names are known, values have their types."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from rbxcompose.expressions.values import Scope, Value
from rbxcompose.findings import Span
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.program.statuses import FAILURE, NAMES, RUNNING, SUCCESS
from rbxcompose.msgs.types import Message
from rbxcompose.plan.model import Plan

SUCCEEDS, FAILS, RUNS = NAMES[SUCCESS], NAMES[FAILURE], NAMES[RUNNING]
HALTED, SKIPPED = "halted", "skipped"

ValueSetting = Callable[[Scope], Value]
"""Computes the value that a test gives to a name."""


@dataclass(frozen=True, slots=True)
class Mock:
    """How a test answers in the place of a skill or a service.

    `main` is the argument to which `fails_for` belongs; `outcomes` tell what each outcome counts as.
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
    """One thing that happens: a word of the file, with what belongs to it."""

    word: str
    settings: Mapping[str, ValueSetting] = field(default_factory=dict)
    topic: str = ""
    message: Message | None = None


@dataclass(frozen=True, slots=True)
class TrialEvent:
    """What happens to the robot at a time [s]."""

    at: float
    deeds: tuple[EventDeed, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class ExpectedStep:
    """A step that is looked for: a call of a skill, a named node or a state.

    `counts_as` tells for the outcomes that this step may have what each counts as.
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
    """A message that is looked for: a topic, and those of its fields that count."""

    topic: str
    fields: Mapping[str, Value]
    span: Span


@dataclass(frozen=True, slots=True)
class ExpectedValue:
    """Something that is expected under a name, with its place."""

    name: str
    value: Value
    span: Span


@dataclass(frozen=True, slots=True)
class Expectations:
    """What must have happened; `until` [s] ends the test before the mission does."""

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
    """A test of a mission on a robot, ready to run; `linked` is the program with all that it uses.

    `is_complete` tells that the test answers for all that the mission asks of the robot, so that no robot is needed.
    """

    name: str
    about: str
    file: str  # as findings show it
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
