"""What a program of others declares: its topics, services and actions with their types, and what it can do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import (
    Acceleration,
    AngularAcceleration,
    AngularSpeed,
    Config,
    Frequency,
    Length,
    Name,
    Ratio,
    Speed,
    Time,
)
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs import registry
from rbxcompose.sdk.capabilities import Capability, CommandsMotion, Drains, Drives, Setting, WritesFrame
from rbxcompose.sdk.ports import (
    ActionName,
    Calls,
    CallsAction,
    In,
    MessageName,
    Out,
    Port,
    Serves,
    ServesAction,
    ServiceName,
)

QosName = Literal["command", "state", "latched", "event", "bulk"]
_LARGE = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/PointCloud2")
_TF = "tf2_msgs/msg/TFMessage"
_ODOMETRY = "nav_msgs/msg/Odometry"
_COMMANDS = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")


def _usual(message: str) -> str:
    return "bulk" if message in _LARGE else "command" if message in _COMMANDS else "state"


def _as_type(value: Any) -> Any:
    return {"type": value} if isinstance(value, str) else value


class PublishedTopic(Config):
    """A topic that it publishes."""

    type: MessageName
    """The type of its messages."""
    rate: Frequency | None = Field(None, gt=0)
    """How often they come at least; fewer are a warning, none an error."""
    qos: QosName | None = None
    """What the topic is for; without it, `command` for velocities, `bulk` for pictures and clouds, else `state`."""
    unit: str = ""
    """What a bare number in the message means: `%`."""


class SubscribedTopic(Config):
    """A topic that it subscribes to."""

    type: MessageName
    """The type of its messages."""
    qos: QosName | None = None
    """What the topic is for; without it, `command` for velocities, `bulk` for pictures and clouds, else `state`."""
    optional: bool = False
    """Whether it works without: then nobody in the robot needs to publish it."""


class ServedAction(Config):
    """An action that it serves, a skill of missions."""

    type: ActionName
    """The type of the action."""
    claims: Literal["", "base", "arm", "head", "voice"] = ""
    """The part of the robot that a goal needs for itself; such goals are cancelled when the robot is stopped."""


PublishedEntry = Annotated[PublishedTopic, BeforeValidator(_as_type, json_schema_input_type=PublishedTopic | str)]
SubscribedEntry = Annotated[SubscribedTopic, BeforeValidator(_as_type, json_schema_input_type=SubscribedTopic | str)]
ActionEntry = Annotated[ServedAction, BeforeValidator(_as_type, json_schema_input_type=ServedAction | str)]


class DrivesModel(Config):
    """A base: it moves the robot."""

    commands: Name = "cmd_vel"
    """Its port for velocities."""
    odometry: Name | Literal[""] = ""
    """Its port with the motion."""
    max_speed: Speed | None = Field(None, gt=0)
    """It limits faster commands to this."""
    max_turn_rate: AngularSpeed | None = Field(None, gt=0)
    """It limits faster turns to this."""
    stops_after: Time | None = Field(None, gt=0)
    """It brakes when no command has come for this long."""
    acceleration: Acceleration | None = Field(None, gt=0)
    """Acceleration, also of braking."""
    turn_acceleration: AngularAcceleration | None = Field(None, gt=0)
    """Angular acceleration, also of braking."""
    wheel_distance: Length | None = Field(None, gt=0)
    """Between the points where the wheels touch the ground."""


class CommandsMotionModel(Config):
    """It sends velocities for a base."""

    commands: Name = "cmd_vel"
    """Its port for them."""
    max_speed: Speed | None = Field(None, gt=0)
    """It sends at most this."""
    max_turn_rate: AngularSpeed | None = Field(None, gt=0)
    """It sends at most this."""


class DrainsModel(Config):
    """A battery."""

    level: Name
    """Its port with the charge."""
    runtime: Time | None = Field(None, gt=0)
    """From full to empty."""
    warn: Ratio | None = None
    """Below this charge its status is WARN."""
    error: Ratio | None = None
    """Below this charge its status is ERROR."""


class CapabilitiesModel(Config):
    """What it can do, for the checks."""

    drives: DrivesModel | None = None
    """It is a base."""
    commands_motion: CommandsMotionModel | None = None
    """It sends velocities for a base."""
    drains: DrainsModel | None = None
    """It is a battery."""
    frames: dict[str, str] = {}
    """Frames that it places at `/tf`, each with its parent."""

    def named_ports(self) -> Iterator[tuple[str, str, str, tuple[str, ...]]]:
        """Yield the ports that they name: the key that does, the port, where it is declared, and its types, if any."""
        if self.drives is not None:
            yield "drives.commands", self.drives.commands, "subscribes", _COMMANDS
            if self.drives.odometry:
                yield "drives.odometry", self.drives.odometry, "publishes", (_ODOMETRY,)
        if self.commands_motion is not None:
            yield "commands_motion.commands", self.commands_motion.commands, "publishes", _COMMANDS
        if self.drains is not None:
            yield "drains.level", self.drains.level, "publishes", ()


class DeclaredPorts(Config):
    """The ports and capabilities that a manifest declares for a program."""

    publishes: dict[TopicName, PublishedEntry] = {}
    """Topics that it publishes: a type, or a map with `type`, `rate`, `qos` and `unit`."""
    subscribes: dict[TopicName, SubscribedEntry] = {}
    """Topics that it subscribes to: a type, or a map with `type`, `qos` and `optional`."""
    serves: dict[TopicName, ServiceName] = {}
    """Services that it serves, each with its type."""
    calls: dict[TopicName, ServiceName] = {}
    """Services that it calls, each with its type."""
    serves_actions: dict[TopicName, ActionEntry] = {}
    """Actions that it serves: a type, or a map with `type` and `claims`."""
    calls_actions: dict[TopicName, ActionName] = {}
    """Actions that it calls, each with its type."""
    capabilities: CapabilitiesModel = CapabilitiesModel()
    """What it can do, for the checks."""

    @field_validator("publishes", "subscribes", "serves", "calls", "serves_actions", "calls_actions")
    @classmethod
    def _have_names_of_their_own(cls, given: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        before = dict(_named(info.data, *_KINDS))
        for port, topic in _named({**info.data, str(info.field_name): given}, str(info.field_name)):
            if port in before:
                raise ValueError(f"'{before[port]}' and '{topic}' would be the same port, '{port}': rename one")
            before[port] = topic
        return given

    @field_validator("capabilities")
    @classmethod
    def _name_its_ports(cls, given: CapabilitiesModel, info: ValidationInfo) -> CapabilitiesModel:
        if not all(kind in info.data for kind in _KINDS):
            return given  # one of them has a mistake, which may be why a port is not there
        for what, port, kind, types in given.named_ports():
            topics = dict(_named(info.data, kind))
            if port not in topics:
                words = f"'{what}' names the port '{port}', which '{kind}' does not have"
                raise PydanticCustomError("name", "{words}", {"words": words, **_names(port, topics, "ports")})
            if types and (found := info.data[kind][topics[port]].type) not in types:
                raise ValueError(f"'{what}' names the port '{port}', which has {found} instead of {' or '.join(types)}")
        frames = info.data["publishes"].get("/tf")
        if given.frames and (frames is None or frames.type != _TF):
            raise ValueError(f"it places frames, so 'publishes' needs '/tf: {_TF}'")
        return given

    def ports(self) -> dict[str, Port[Any]]:
        """Return its ports by name: that of the topic, with underscores for slashes."""
        names = (name for name, _ in _named(dict(self), *_KINDS))
        return {name: port.named(name).elsewhere() for name, port in zip(names, self._declared(), strict=True)}

    def _declared(self) -> Iterator[Port[Any]]:
        for topic, given in self.publishes.items():
            qos = given.qos or _usual(given.type)
            yield Out(registry.message(given.type), topic, qos=qos, unit=given.unit, rate=given.rate)
        for topic, taken in self.subscribes.items():
            message = registry.message(taken.type)
            qos = taken.qos or _usual(taken.type)
            yield In(message, topic, qos=qos, is_open=taken.optional, may_be_silent=taken.optional)
        for topic, service in self.serves.items():
            yield Serves(registry.service(service), topic)
        for topic, service in self.calls.items():
            yield Calls(registry.service(service), topic)
        for topic, action in self.serves_actions.items():
            yield ServesAction(registry.action(action.type), topic, claims=action.claims)
        for topic, name in self.calls_actions.items():
            yield CallsAction(registry.action(name), topic)

    def declared_capabilities(self) -> Iterator[Capability]:
        """Yield what it can do, each value with its field."""
        can = self.capabilities
        if can.drives is not None:
            yield Drives(can.drives.commands, can.drives.odometry, **_settings("drives", can.drives))
        if can.commands_motion is not None:
            yield CommandsMotion(can.commands_motion.commands, **_settings("commands_motion", can.commands_motion))
        if can.drains is not None:
            yield Drains(can.drains.level, **_settings("drains", can.drains))
        for child, parent in can.frames.items():
            yield WritesFrame("tf", Setting(parent), Setting(child))


_PORTS = ("commands", "odometry", "level")  # fields that name ports; the others are settings


def _settings(name: str, model: Config) -> Mapping[str, Any]:
    given = {field: value for field, value in model if field not in _PORTS and value is not None}
    return {field: Setting(value, f"capabilities.{name}.{field}") for field, value in given.items()}


_KINDS = ("publishes", "subscribes", "serves", "calls", "serves_actions", "calls_actions")


def _named(data: Mapping[str, Any], *kinds: str) -> Iterator[tuple[str, str]]:
    """Yield the ports of declared topics, services and actions by name, each with its topic.

    Where a topic is published as well, `tf` is the port that publishes and `tf_in` the one that subscribes.
    """
    for kind in kinds:
        for topic in data.get(kind, ()):
            both = kind == "subscribes" and topic in data.get("publishes", ())
            yield f"{port_name(topic)}_in" if both else port_name(topic), topic


def _names(name: str, valid: Iterable[str], what: str) -> dict[str, Any]:
    return {"name": name, "valid": tuple(valid), "what": what}


def published(topic: str, publishes: Mapping[str, PublishedTopic]) -> str:
    """Return a topic that is waited for if it is published.

    Raises:
        PydanticCustomError: if it is not.
    """
    if topic and topic not in publishes:
        words = f"it waits for the topic '{topic}', which 'publishes' does not have"
        raise PydanticCustomError("name", "{words}", {"words": words, **_names(topic, publishes, "topics")})
    return topic


def port_name(topic: str) -> str:
    """Return the name of the port of a topic: `wheels_odom` for `wheels/odom`."""
    return topic.strip("/").replace("/", "_")
