"""Where on the bus the values and skills are that a mission names."""

from __future__ import annotations

from dataclasses import dataclass

from rbxcompose.expressions.types import UNKNOWN, Type
from rbxcompose.missions.program import Skill


@dataclass(frozen=True, slots=True)
class ValueSource:
    """Where a value comes from: a field (with dots) of the messages on a topic, times `scale` for SI."""

    topic: str
    message: str
    field: str
    scale: float = 1.0
    type: Type = UNKNOWN


@dataclass(frozen=True, slots=True)
class SkillSource:
    """A skill, the ROS name of its action's type, and the action's name."""

    skill: Skill
    action: str
    topic: str
