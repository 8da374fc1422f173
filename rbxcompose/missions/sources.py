"""Where on the bus the values and skills are that a mission names."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from rbxcompose.expressions.types import UNKNOWN, Type
from rbxcompose.missions.program import Skill

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


class Way(StrEnum):
    """How a skill is carried out."""

    ACTION = "action"
    SERVICE = "service"
    PYTHON = "python"


@dataclass(frozen=True, slots=True)
class SkillSource:
    """A skill, the ROS name of the type of its action or service, and the name of that; both empty for Python."""

    skill: Skill
    action: str
    topic: str
    way: Way = Way.ACTION


@dataclass(frozen=True, slots=True)
class TopicSource:
    """A topic on which a mission publishes: the ROS name of its type, and the class of its quality."""

    message: str
    qos: str = "event"
