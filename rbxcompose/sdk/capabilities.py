"""Capabilities: what the compiler and the tools need to know about a component, as declared by the component itself.

No rule identifies a component by the name of its type: a battery, base or driver from elsewhere is equal to ours. A
text in a capability is the name of a port of the component; everything else is a `Setting`. Quantities are in SI.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, replace
from functools import cache
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from rbxcompose.base.config import Config, Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2

T_co = TypeVar("T_co", covariant=True)
C = TypeVar("C", bound="Capability")
Outline = tuple[float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Setting(Generic[T_co]):
    """A value and its field in the configuration: `Setting(config.max_speed, "max_speed")`.

    Findings point at that field in the manifest. A nested field is written with a dot; a value that cannot be
    configured has no field.
    """

    value: T_co
    field: str = ""


@dataclass(frozen=True, slots=True)
class Capability:
    """Something that a component can do, or does to the robot; the set is closed."""


@dataclass(frozen=True, slots=True)
class Drives(Capability):
    """A base: it moves the robot at the velocities from its input `commands`."""

    commands: str
    odometry: str = ""
    """The output with its motion."""
    max_speed: Setting[float] | None = None
    """It limits faster commands to this [m/s]."""
    max_turn_rate: Setting[float] | None = None
    """It limits faster turns to this [rad/s]."""
    drops_above: Setting[float] | None = None
    """It ignores commands above this multiple of its limits instead of limiting them."""
    stops_after: Setting[float] | None = None
    """It brakes when no command has arrived for this long [s]; infinite if never."""
    acceleration: Setting[float] | None = None
    """Acceleration, also of braking [m/s^2]."""
    turn_acceleration: Setting[float] | None = None
    """Angular acceleration, also of braking [rad/s^2]."""
    wheel_distance: Setting[float] | None = None
    """Between the points where the wheels touch the ground, which are beside its middle [m]."""


@dataclass(frozen=True, slots=True)
class RollsOn(Capability):
    """A base on two driven wheels; they are joints of the body, whose positive direction is forwards."""

    left: Setting[str]
    """The joint of the left wheel."""
    right: Setting[str]
    """The joint of the right wheel."""
    wheel_distance: Setting[float]
    """Between the points where the wheels touch the ground [m]."""
    wheel_radius: Setting[float] | None = None
    """[m]."""
    link: Setting[str] | None = None
    """The link of the body that moves with the base: x is forwards."""


@dataclass(frozen=True, slots=True)
class TurnsJoints(Capability):
    """It gives set points of joints to the physics engine, which moves them as far as they are strong."""

    efforts: Setting[Mapping[str, float | None]]
    """The most that it exerts on each [Nm or N], None if only the body says that."""


@dataclass(frozen=True, slots=True)
class SensesPhysics(Capability):
    """It measures in the physics engine: pictures if it has a `view`, else how its frame moves."""

    frame: Setting[str]
    """The link of the body that it is on."""
    topic: Setting[str]
    """Below `physics/` and this, the engine tells it what it measures."""
    view: Setting[tuple[int, int, float]] | None = None
    """Width and height of its pictures in pixels, and from its left to its right edge [rad]."""


@dataclass(frozen=True, slots=True)
class CommandsMotion(Capability):
    """It sends velocities for a base at its output `commands`, up to these limits."""

    commands: str
    max_speed: Setting[float] | None = None
    """[m/s]."""
    max_turn_rate: Setting[float] | None = None
    """[rad/s]."""
    acceleration: Setting[float] | None = None
    """By which it accelerates and brakes [m/s^2]."""
    protects: bool = False
    """Whether it commands only to protect the robot, so that nobody else may overrule it."""


@dataclass(frozen=True, slots=True)
class Navigates(Capability):
    """It drives the robot to the pose in the main argument of the skill at its port `goals`."""

    goals: str
    tolerance: Setting[float] | None = None
    """How far from the goal it may end [m]."""
    max_speed: Setting[float] | None = None
    """[m/s], unless declared as what it commands."""
    least_time: Callable[[Pose2, Pose2, Drives | None], float] | None = None
    """Returns the least time from a pose to another on this base [s]; without it, that of the way at full speed."""
    radius: Setting[float] | None = None
    """Of the circle around its origin that it keeps free [m]; None if it keeps another shape free."""
    inflation: Setting[float] | None = None
    """Up to this distance from obstacles, ways are dearer to it [m]."""
    sees: Setting[float] | None = None
    """Up to this distance, what its sensor sees counts [m]; None without one."""
    silence: Setting[float] | None = None
    """Without news of its sensor for so long, it stops [s]."""


@dataclass(frozen=True, slots=True)
class SeesEdges(Capability):
    """It sees whether there is floor below `points` of the base."""

    points: Setting[Mapping[str, tuple[float, float]]]
    """By name, x (ahead) and y (to the left) from the middle of the base [m]."""


@dataclass(frozen=True, slots=True)
class Drains(Capability):
    """A battery: its output `level` publishes its charge in the only field of the message, in the unit of the port."""

    level: str
    runtime: Setting[float] | None = None
    """Time from full to empty [s]."""
    warn: Setting[float] | None = None
    """Below this charge its status is WARN (a ratio)."""
    error: Setting[float] | None = None
    """Below this charge its status is ERROR (a ratio)."""


@dataclass(frozen=True, slots=True)
class Warns(Capability):
    """It compares a number with limits: its status is WARN beyond one of them, and ERROR beyond the other."""

    warn: Setting[float] | None
    error: Setting[float] | None
    is_above: bool
    """Whether more is worse."""


@dataclass(frozen=True, slots=True)
class Charges(Capability):
    """It charges the robot's battery, by the skill at its port `goals`."""

    goals: str
    place: Setting[Place] | None = None
    """The place where it charges."""
    reach: Setting[float] | None = None
    """Largest distance from that place [m]."""
    until: Setting[float] | None = None
    """It ends at or above this charge (a ratio)."""


TELEOP = "teleop"  # the input of a mux that is for people


@dataclass(frozen=True, slots=True)
class Forwards(Capability):
    """A mux: it forwards messages from one of `inputs` to `output`; the first of them has the highest priority."""

    inputs: tuple[str, ...]
    output: str


@dataclass(frozen=True, slots=True)
class LocksInSilence(Capability):
    """A mux: its lock `name` holds inputs back once its heartbeat has been silent for `timeout` [s]."""

    name: Setting[str]
    timeout: Setting[float]


@dataclass(frozen=True, slots=True)
class BoundsGoals(Capability):
    """It refuses goals at its port `goals` whose arguments are beyond limits: those of joints, or its own."""

    goals: str
    joints: Setting[Mapping[str, str]] | None = None
    """Arguments that are positions of joints, with the joint of each."""
    ranges: Setting[Mapping[str, tuple[float, float]]] | None = None
    """Arguments with the least and the greatest value of each, in SI."""
    speed: Setting[float] | None = None
    """How fast it moves these joints, [rad/s or m/s]."""
    duration: Setting[str] | None = None
    """The argument that says how long a motion takes [s], if one that is too fast for its joints is refused."""
    unless: Setting[str] | None = None
    """The argument that says by how much a goal may be missed: with it, none is refused."""


@dataclass(frozen=True, slots=True)
class WritesFrame(Capability):
    """Its output `transforms` publishes the pose of frame `child` in frame `parent`."""

    transforms: str
    parent: Setting[str]
    child: Setting[str]
    needs_parent: bool = False
    """Whether it only adds `child` to a frame that something else places."""


@dataclass(frozen=True, slots=True)
class MeasuresIn(Capability):
    """Messages of its output `port` are in the frame `frame`, or its input `port` takes only those that are."""

    port: str
    frame: Setting[str]


@dataclass(frozen=True, slots=True)
class PutsThings(Capability):
    """It puts things into the planning scene, which stand still in the frame `stands_in`."""

    stands_in: Setting[str]


@dataclass(frozen=True, slots=True)
class ConnectedBy(Capability):
    """Its hardware is at a serial port, which it alone can open; also declared when a twin stands in for it."""

    port: Setting[str]
    """A path, or `usb:VENDOR:PRODUCT` with `:SERIAL` behind it if there is one; for a device of the robot with
    `dev:NAME=` before it."""

    @property
    def name(self) -> str:
        """Return the port as manifests name it: a path, `dev:NAME`, or `usb:VENDOR:PRODUCT`."""
        port = self.port.value
        return port.partition("=")[0] if port.startswith("dev:") else port

    def is_among(self, devices: Iterable[str]) -> bool:
        """Return whether these `devices` of a host have it, by its name or by what a device of the robot is."""
        return not {self.name, self.port.value.removeprefix(f"{self.name}=")}.isdisjoint(devices)


@dataclass(frozen=True, slots=True)
class OpensPort(ConnectedBy):
    """It opens a serial port of this machine, which `up` looks at before anything starts."""


@dataclass(frozen=True, slots=True)
class ExpectsRate(Capability):
    """It warns when messages come to its input `port` less often than `least`, or more often than `most` [Hz]."""

    port: str
    least: Setting[float]
    most: Setting[float] | None = None
    tolerance: float = 0.0
    """The share by which a rate may miss them."""

    def missed_by(self, rate: float) -> Setting[float] | None:
        """Return the limit that a rate [Hz] does not keep."""
        if rate < self.least.value * (1 - self.tolerance):
            return self.least
        return self.most if self.most and rate > self.most.value * (1 + self.tolerance) else None


@dataclass(frozen=True, slots=True)
class NeedsExtra(Capability):
    """It imports a package that an extra of rbxcompose brings; `up` looks for it before anything starts."""

    module: Setting[str]
    """What it imports."""
    extra: Setting[str]
    """The extra: `pip install 'rbxcompose[servos]'` brings `servos`."""


@dataclass(frozen=True, slots=True)
class RunsProgram(Capability):
    """It runs a program of others in real time; `up` looks for that before anything starts."""

    command: Setting[tuple[str, ...]]
    """Its words; the first is a path from `folder`, or the name of an executable in PATH."""
    folder: Setting[str] = Setting("")
    """Where it runs."""
    environment: Setting[Mapping[str, str]] = Setting({})
    """Variables of its own; PATH may be one of them."""


@dataclass(frozen=True, slots=True)
class RunsRosNode(Capability):
    """It runs a node of ROS 2 in real time; `up` looks for that ROS 2 before anything starts."""

    python: Setting[str]
    """Its Python, if the manifest names it."""
    setup: Setting[str]
    """Its setup file, if the manifest names it."""


@dataclass(frozen=True, slots=True)
class RunsContainer(Capability):
    """It runs an image in real time; `up` looks for it and for what runs it before anything starts."""

    image: Setting[str]
    """The image."""
    engine: Setting[str]
    """What runs it: `docker`, `podman`, or `auto` for the first one that works."""


@dataclass(frozen=True, slots=True)
class ServesPage(Capability):
    """It serves a page for browsers; `up` shows the link."""

    port: Setting[int]
    """TCP port."""
    listen: Setting[str] = Setting("local")
    """Who may open it: `local`, or `lan` also for other machines, with a token."""
    commands: Setting[str] = Setting("")
    """The topic on which people drive by it, by its full name; empty if they cannot."""
    fleet: Setting[Mapping[str, str]] = Setting(MappingProxyType({}))
    """Where the pages of a system's robots are, by robot: `ADDRESS:PORT`, without an address on the same host."""
    camera: Setting[str] = Setting("")
    """The topic of the pictures that it shows, by its full name; empty if there is none."""
    foxglove: Setting[int] = Setting(0)
    """TCP port for Foxglove on this machine; 0 for none."""


@dataclass(frozen=True, slots=True)
class SharesWorld(Capability):
    """It puts the robot into a simulated world, in which the system's other robots are, too."""

    outline: Setting[Outline]
    """Where the robot begins in `map`, and its size: x, y [m], heading [rad], radius and height [m]."""
    others: Setting[Mapping[str, Outline]]
    """The same of the others, by robot; the system knows them."""


@dataclass(frozen=True, slots=True)
class RunsMissions(Capability):
    """It runs the robot's missions: its skills are those of the robot, and values may come from outside."""


def within(capability: C, ports: str, fields_: str) -> C:
    """Return a capability of a part of a component: these begin the names of its ports, and those of its fields."""
    changed = {field.name: _within(getattr(capability, field.name), ports, fields_) for field in fields(capability)}
    return replace(capability, **changed)


def _within(value: object, ports: str, fields_: str) -> object:
    match value:
        case Setting(value=inner, field=str(field)) if field:
            return Setting(inner, f"{fields_}{field}")
        case str() if value:
            return f"{ports}{value}"
        case tuple():
            return tuple(f"{ports}{port}" for port in value)
    return value


def settings_of(capability: Capability) -> Iterator[Setting[Any]]:
    """Yield the settings of a capability."""
    yield from (value for value in _values(capability) if isinstance(value, Setting))


def require_declared(
    who: str, capabilities: Iterable[Capability], ports: Iterable[str], config: type[Config]
) -> tuple[Capability, ...]:
    """Return the capabilities of the type `who` if their ports and fields exist.

    Raises:
        ValueError: if one does not.
    """
    known, declared = {"", *ports}, tuple(capabilities)
    for capability in declared:
        what = f"the capability {type(capability).__name__} of the type '{who}'"
        for port in _ports(capability):
            if port not in known:
                raise ValueError(f"{what} names the port '{port}', which it does not have")
        for setting in settings_of(capability):
            if setting.field and setting.field.partition(".")[0] not in config.model_fields:
                raise ValueError(f"{what} names the field '{setting.field}', which its configuration does not have")
    return declared


def _ports(capability: Capability) -> Iterator[str]:
    for value in _values(capability):
        if isinstance(value, str):
            yield value
        elif isinstance(value, tuple):
            yield from value  # of several ports


def _values(capability: Capability) -> list[object]:
    kind: Any = type(capability)
    return [getattr(capability, name) for name in _names(kind)]


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))
