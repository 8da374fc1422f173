"""The file of a test as types: the shape of its contents; what the names mean depends on the robot."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, StringConstraints
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import Config, Name, Time
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.fields import TopicName

LONGEST_TEST = 3600.0  # [s] of robot time


def _given(value: bool) -> bool:
    if not value:
        raise PydanticCustomError("order", "must be true, or left out")
    return value


TrueOnly = Annotated[bool, AfterValidator(_given)]
CallNumber = Annotated[str, StringConstraints(pattern=r"^[1-9][0-9]{0,5}$")]


class TrialFile(ManifestHeader):
    """A test of a mission: what happens to it, and what it must do."""

    robot: Any = None
    """The robot's file, relative to this one, or `rbx:robots/NAME`."""
    also: Any = None
    """Further robots with which it runs, with the same profile: each has the same mission."""
    profile: Any = None
    """The profile of the robot with which it runs."""
    mission: Any = None
    """The mission that is tested, by the name that it has in the robot."""
    with_: Any = Field(None, alias="with")
    """Values of its inputs, by name, instead of those of the robot."""
    mocks: Any = None
    """Skills and services that the test mocks, by name; all others run for real."""
    events: Any = None
    """Events from outside, and when they happen."""
    expect: Any = None
    """What must have happened in the end."""


class MockModel(Config):
    """How the test answers instead of a skill or a service."""

    takes: Time = Field(0.0, ge=0)
    """How long each call takes."""
    result: Name = "success"
    """How calls end: `success`, `failure`, or an outcome that the skill declares."""
    message: str = ""
    """The reason given for a failure."""
    sets: dict[Name, Any] = {}
    """Values that are set when a call has succeeded, by expressions that also see the arguments of the call."""
    fails_at: tuple[Annotated[int, Field(ge=1)], ...] = ()
    """Which calls fail, counted from 1; halted calls do not count."""
    fails_for: tuple[Any, ...] = ()
    """Values of the main argument for which calls fail."""
    outcome_at: dict[CallNumber, Name] = {}
    """Outcome by number of the call, where it differs from `result`."""


class SentModel(Config):
    """A message."""

    topic: TopicName
    """Where it is published."""
    message: Any = None
    """Its fields; a single value sets the only field."""


class InjectedModel(Config):
    """A fault of simulated servos."""

    fault: Name
    """What goes wrong: `overheat`, `jam`, `mute`, ..."""
    joint: str | None = None
    """The joint whose servo has it."""
    bus: Name | None = None
    """The bus all of whose servos have it, instead of a joint; `unplug` is of a bus."""
    for_: Time | None = Field(None, gt=0, alias="for")
    """How long it lasts; without it for good."""


class EventModel(Config):
    """Something that happens to the robot; simultaneous events happen in the order of the text."""

    at: Time = Field(ge=0)
    """When, counted from the start of the test."""
    set_: dict[Name, Any] = Field({}, alias="set")
    """Values that get this value now, and keep it until the test sets them again."""
    publish: SentModel | None = None
    """A message that comes from outside."""
    fault: InjectedModel | None = None
    """Something that goes wrong with simulated servos, as in `faults` of a robot."""
    stop: TrueOnly = False
    """The robot is stopped, and its mission paused."""
    release: TrueOnly = False
    """The stop is released."""
    pause: TrueOnly = False
    """The mission is paused."""
    resume: TrueOnly = False
    """The mission continues."""


class ExpectModel(Config):
    """What must have happened."""

    outcome: Name | None = None
    """How the mission ends: `success`, `failure`, an end of its own, or `running` together with `for`."""
    for_: Time | None = Field(None, gt=0, le=LONGEST_TEST, alias="for")
    """How long it is watched, an hour at most."""
    steps: tuple[Any, ...] = ()
    """Steps in this order; others may come between."""
    never: tuple[Any, ...] = ()
    """Steps that must not happen."""
    count: dict[Name, int] = {}
    """How often a step starts, by its name."""
    data: dict[Name, Any] = {}
    """Values of the mission's data at the end."""
    published: tuple[SentModel, ...] = ()
    """Messages that it publishes, in this order; only the fields listed count."""
    reports: tuple[str, ...] = ()
    """Texts that are part of what it logs or reports."""


def _in_full(value: object) -> object:
    if value is None:
        return {}
    return {"result": value} if isinstance(value, str) else value


ShortMock = Annotated[MockModel, BeforeValidator(_in_full, json_schema_input_type=MockModel | Name | None)]
"""A mock, its result as a word, or nothing: it then succeeds immediately."""

SECTIONS = {"mocks": dict[Name, ShortMock], "events": tuple[EventModel, ...], "expect": ExpectModel}
"""Content of each section."""
STEP_KEYS = ("ended", "at")  # beside the name of a step
