"""Where on the bus the values and skills are that a mission names."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from rbxcompose.expressions.types import UNKNOWN, Type
from rbxcompose.missions.program.program import Skill

PAUSE = "pause"  # below the name of an action that can pause: the service by which it does
OUTCOME = "outcome"  # the field of a result in which an action tells an outcome of its own


@dataclass(frozen=True, slots=True)
class ValueSource:
    """Where a value comes from: a field (with dots) of the messages on a topic, times `times / per` for SI.

    With `group` it is the level of that group of the diagnostics, as a word.
    """

    topic: str
    message: str
    field: str
    times: float = 1.0
    per: float = 1.0
    type: Type = UNKNOWN
    group: str = ""


class SkillWay(StrEnum):
    """How a skill is carried out."""

    ACTION = "action"
    SERVICE = "service"
    TOPIC = "topic"
    PYTHON = "python"


@dataclass(frozen=True, slots=True)
class OrderTopic:
    """A topic that belongs to orders: its name, the ROS name of its type, the class of its quality."""

    topic: str
    message: str
    qos: str


@dataclass(frozen=True, slots=True)
class Orders:
    """How orders on a topic are carried out: the class of its quality, and the components that do it.

    `ends` is where it is told how an order ended, `halts` where one is given up.
    """

    qos: str
    servers: tuple[str, ...]
    ends: OrderTopic | None = None
    halts: OrderTopic | None = None


@dataclass(frozen=True, slots=True)
class SkillSource:
    """A skill, the ROS name of the type of its action, service or topic, and the name of that; empty for Python.

    `orders` belongs to topics only.
    """

    skill: Skill
    action: str
    topic: str
    way: SkillWay = SkillWay.ACTION
    orders: Orders = Orders("event", ())


@dataclass(frozen=True, slots=True)
class TopicSource:
    """A topic on which a mission publishes: the ROS name of its type, and the class of its quality."""

    message: str
    qos: str = "event"
