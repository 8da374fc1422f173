"""Where on the bus to find the values and skills that a mission names."""

from collections.abc import Mapping
from enum import StrEnum

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.missions.program.program import Skill

PAUSE = "pause"  # below the name of an action that can pause: the service that pauses it
OUTCOME = "outcome"  # the field of a result with the action's own outcome


@dataclass(frozen=True, slots=True)
class ValueSource:
    """Where a value comes from: a field (with dots) of the messages on a topic, times `times / per` for SI.

    With `group`, it is the level of that group of the diagnostics, as a word. An event counts only for conditions of
    nodes that began before it came.
    """

    topic: str
    message: str
    field: str
    times: float = 1.0
    per: float = 1.0
    type: Type = UNKNOWN
    group: str = ""
    is_event: bool = False
    is_latched: bool = False


def events_of(values: Mapping[str, ValueSource]) -> frozenset[str]:
    """Return the names of the values that are events."""
    return frozenset(name for name, source in values.items() if source.is_event)


class SkillWay(StrEnum):
    """How a skill is carried out."""

    ACTION = "action"
    SERVICE = "service"
    TOPIC = "topic"
    PYTHON = "python"


@dataclass(frozen=True, slots=True)
class OrderTopic:
    """A topic that belongs to orders: its name, its ROS type, and its QoS class."""

    topic: str
    message: str
    qos: str


@dataclass(frozen=True, slots=True)
class Orders:
    """How orders on a topic are carried out: its QoS class, and the components that do it.

    `ends` is the topic that reports how an order ended, `halts` the one that cancels an order.
    """

    qos: str
    servers: tuple[str, ...]
    ends: OrderTopic | None = None
    halts: OrderTopic | None = None


@dataclass(frozen=True, slots=True)
class SkillSource:
    """A skill, and the ROS type and the name of its action, service or topic; empty for Python.

    `orders` is for topics only.
    """

    skill: Skill
    action: str
    topic: str
    way: SkillWay = SkillWay.ACTION
    orders: Orders = Orders("event", ())


@dataclass(frozen=True, slots=True)
class TopicSource:
    """A topic on which a mission publishes: its ROS type, and its QoS class."""

    message: str
    qos: str = "event"
