"""The sections of a robot's file as types, and the robot as it comes out of the front end."""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StringConstraints

from rbxcompose.config import Angle, Config, Frequency, Length, Name, Place, Time
from rbxcompose.findings import Span
from rbxcompose.manifest.history import History
from rbxcompose.manifest.inclusions import Inclusions
from rbxcompose.manifest.tree import Mapping
from rbxcompose.restarts import DEFAULT, Restart, When

SECTIONS = (
    *("args", "bus", "components", "include", "body", "buses", "actuators", "joints", "controllers", "safety"),
    *("places", "missions", "start", "muxes", "diagnostics", "values", "profiles"),
    *("devices", "console", "security", "record"),
)
"""The words that a section of a robot's file has or will have."""

ALWAYS_THERE = ("transforms", "mission")
"""Components that every robot runs, beside `diagnostics`."""

DESCRIPTION = "robot_description"
"""The component that a robot with a body runs."""

TopicName = Annotated[str, StringConstraints(pattern=r"^/?[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)*$", max_length=255)]
InterfaceName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(/(msg|srv|action))?/[A-Z][A-Za-z0-9]*$")]
PortName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?$", max_length=121)]


def _short_for(key: str, model: type[Config], word: Any = str) -> BeforeValidator:
    """Let one word stand for a map with that one key."""
    return BeforeValidator(
        lambda value: {key: value} if isinstance(value, str) else value, json_schema_input_type=model | word
    )


class Header(Config):
    """The keys that every manifest begins with."""

    rbx: Literal[1]
    """Version of the language."""
    kind: str
    """What this file describes: `Robot`, `Part`, `Overlay`, `Mission` or `Test`."""
    name: Name
    """Its name: small letters, digits and underscores."""
    about: str = ""
    """What it is for, in a sentence."""


class Sections(Header):
    """What robots, parts and overlays have in common."""

    args: Any = None
    """Arguments by name: what a user of the robot or part may want to set, read by `${args.NAME}`."""
    include: Any = None
    """Parts of which the robot is made, by the name of the instance, which stands before all names of the part."""
    body: Any = None
    """What the robot looks like and how it moves: its URDF, which is published for viewers and other programs."""
    components: Any = None
    """What runs, by name: a `type`, the settings of that type, and options that every type takes."""
    muxes: Any = None
    """Who may command, by the topic that is commanded: the live input of the largest priority is let through."""
    diagnostics: Any = None
    """How the states of components are grouped: each group is OK, WARN, ERROR or STALE."""
    places: Any = None
    """Places by name: poses in `map`, to which missions refer."""
    values: Any = None
    """Short names for data that missions read by `$NAME`."""
    missions: Any = None
    """Missions that the robot has, by name: their files, and the values of their inputs."""


class RobotFile(Sections):
    """A robot: what it is made of and how that is connected."""

    bus: Any = None
    """How its messages travel."""
    start: Any = None
    """The mission that `up` runs."""
    profiles: Any = None
    """Changes to the robot by name, made when asked for by `--profile NAME`."""


class OverlayFile(Sections):
    """Changes to a robot, given by `-f FILE`."""

    bus: Any = None
    """How its messages travel."""
    start: Any = None
    """The mission that `up` runs."""


class PartFile(Sections):
    """Something that robots are made of: sections of a robot with arguments of their own."""

    needs: Any = None
    """What must be there outside of the part; `check` sees to it."""
    provides: Any = None
    """What the part gives to the rest of the robot, by the part's own names; `check` sees to it."""


class Needs(Config):
    """What must be there outside of a part."""

    ports: dict[TopicName, InterfaceName] = {}
    """Topics with their types, such as `cmd_vel: geometry_msgs/Twist`."""


class Provides(Config):
    """What a part gives to the rest of the robot, by the names that its file has for it."""

    ports: dict[TopicName, InterfaceName] = {}
    """Topics with their types."""
    skills: tuple[Name, ...] = ()
    """Skills of missions."""
    values: tuple[Name, ...] = ()
    """Values that missions read."""


class Include(Config):
    """An instance of a part."""

    part: str
    """The part's file, relative to this one, or `rbx:parts/NAME.yaml` of the library."""
    with_: dict[Name, Any] = Field({}, alias="with")
    """Values of its arguments, by name."""
    connect: dict[TopicName, TopicName] = {}
    """Other names for its topics: those of its ports, of its muxes, and `MUX/INPUT` of a mux's inputs."""


class Bus(Config):
    """How the robot's messages travel."""

    domain: int = Field(0, ge=0, le=232)
    """ROS domain; robots of different domains do not hear each other."""
    namespace: TopicName | None = None
    """Prefix of all relative topics."""
    port: int = Field(7447, ge=1, le=65535)
    """TCP port of the robot's router; the next free one is taken if it is in use."""
    wire: Literal["jazzy"] = "jazzy"
    """The ROS 2 distribution whose wire format is spoken."""
    router: str | None = None
    """An existing router to use instead of an own one, such as `tcp/192.168.0.2:7447`."""
    clock: Literal["own", "external"] = "own"
    """Whose time the robot follows: its own, or that of a simulator outside, which publishes it on `/clock`."""


class Body(Config):
    """What the robot looks like and how it moves."""

    urdf: str
    """The URDF file, relative to this one; it goes out on the topic `robot_description`, as it is."""


RestartModel = Annotated[Restart, _short_for("when", Restart, When)]


class ComponentOptions(Config):
    """What every component takes beside its own configuration."""

    process: Name | None = None
    """Its process group; what shares a group shares a process."""
    starts_after: tuple[Name, ...] = ()
    """Components that are active before this one."""
    restart: RestartModel = DEFAULT
    """When it is tried again after a failure: a word, or a map with `when`, `max`, `within` and `backoff`."""
    log: Literal["info", "warn", "error"] = "info"
    """The least level of what it writes to the log."""
    connect: dict[Name, TopicName] = {}
    """Topics by port, where they differ from the port's name."""


OPTIONS = tuple(ComponentOptions.model_fields)


class MuxInput(Config):
    """One source of a mux."""

    priority: int
    """The larger one wins."""
    timeout: Time = Field(gt=0)
    """It has lost its turn after this long without a message."""
    source: PortName | None = Field(None, alias="from")
    """The component, or `component.port`, whose output this is; without it the input is open to the outside."""
    max_rate: Frequency | None = Field(None, gt=0)
    """More is not taken from one publisher elsewhere: it is dropped, and told in diagnostics. 1000 Hz if left out."""


class MuxLock(Config):
    """A heartbeat that locks when it is silent."""

    priority: int
    """Inputs of a lower priority are locked."""
    timeout: Time = Field(gt=0)
    """Silence that locks."""


class Mux(Config):
    """Lets one of several sources command an output."""

    inputs: dict[Name, MuxInput] = Field(min_length=1)
    """Sources by name."""
    locks: dict[Name, MuxLock] = {}
    """Locks by name."""


class Analyzer(Config):
    """One group of statuses."""

    match: tuple[str, ...] = Field(min_length=1)
    """Names of components, or patterns with `*`."""
    timeout: Time | None = Field(None, gt=0)
    """A status that is older is stale."""
    expected: tuple[str, ...] = ()
    """Names that must report, whatever matches."""


class Diagnostics(Config):
    """How the states of components are grouped."""

    analyzers: dict[Name, Analyzer] = {}
    """Groups by name."""


class PlaceModel(Config):
    """A named pose in `map`."""

    x: Length
    """Position along x."""
    y: Length
    """Position along y."""
    heading: Angle = 0.0
    """Direction, counted from x towards y: 90 deg looks along y."""
    colour: str = ""
    """How viewers draw it."""


class Value(Config):
    """A short name for data that missions read: `port` of a component, or `topic` and `field` from outside."""

    port: PortName | None = None
    """`component.port`."""
    topic: TopicName | None = None
    """Topic of data from outside."""
    field: PortName | None = None
    """Field of its message; without it, `data`."""
    type: str | None = None
    """What it is: a dimension, `number`, `text`, `flag`, ..."""
    unit: str | None = None
    """Unit of the message, where it is another than that of the type."""


class Mission(Config):
    """A mission that the robot has."""

    file: str
    """The mission's file, relative to this one."""
    with_: dict[Name, Any] = Field({}, alias="with")
    """Values of its inputs, by name."""


IncludeModel = Annotated[Include, _short_for("part", Include)]
ValueModel = Annotated[Value, _short_for("port", Value)]
MissionModel = Annotated[Mission, _short_for("file", Mission)]


@dataclass(frozen=True, slots=True)
class ComponentEntry:
    """A component that the user wrote; `config` is None if it has mistakes."""

    name: str
    type: str
    options: ComponentOptions
    config: Config | None
    span: Span


@dataclass(frozen=True, slots=True)
class MissionEntry:
    """A mission of the robot: its file, and the values for its inputs as nodes."""

    name: str
    path: Path
    with_: Mapping
    span: Span


@dataclass(frozen=True, slots=True)
class Description:
    """What describes the robot's body: a URDF file and its text, which has been read without mistakes."""

    path: Path
    text: str


class About(StrEnum):
    """What a claim of a part is about."""

    NEED = "a topic that it needs"
    PORT = "a topic that it gives"
    SKILL = "a skill"
    VALUE = "a value"


@dataclass(frozen=True, slots=True)
class Claim:
    """One thing that a part needs or provides, by the name that it has in the robot; `type` is that of a topic."""

    about: About
    name: str
    type: str
    span: Span


@dataclass(frozen=True, slots=True)
class IncludedPart:
    """An instance of a part: what it brought, by the names that this has in the robot.

    `name` is the path of the instance (`arm.hand`); what a part includes belongs to it too.
    """

    name: str
    file: str  # as findings show it
    span: Span  # of the entry that includes it
    components: frozenset[str]
    muxes: frozenset[str]  # those that it has an input or a lock of
    values: frozenset[str]
    claims: tuple[Claim, ...]  # what it needs and provides


@dataclass(frozen=True, slots=True)
class RobotManifest:
    """A robot after composition: everything that its file says, in the order in which it says it."""

    name: str
    about: str
    path: Path
    root: Mapping  # composed and filled; the places of everything below
    is_simulated: bool
    bus: Bus
    body: Description | None = None
    components: AnyMapping[str, ComponentEntry] = field(default_factory=dict)
    muxes: AnyMapping[str, Mux] = field(default_factory=dict)
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    places: AnyMapping[str, Place] = field(default_factory=dict)
    values: AnyMapping[str, Value] = field(default_factory=dict)
    missions: AnyMapping[str, MissionEntry] = field(default_factory=dict)
    start: str | None = None
    parts: AnyMapping[str, IncludedPart] = field(default_factory=dict)
    profiles: AnyMapping[str, Span] = field(default_factory=dict)  # from the name to the end of what it changes
    include: Mapping = field(default_factory=Mapping)  # composed; what it names is part of `root` already
    history: History = field(default_factory=History)
    overlays: tuple[str, ...] = ()  # the files of `-f`, as findings show them
    files: AnyMapping[str, Path] = field(default_factory=dict)  # every file that was read, by the name that is shown
    inclusions: Inclusions = field(default_factory=Inclusions)
