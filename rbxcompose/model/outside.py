"""What a robot has of others, if it is one of a system: their topics, services and actions, below their names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.missions.program.sources import SkillSource


@dataclass(frozen=True, slots=True)
class Outside:
    """What other robots give, by absolute names; their skills are called `ROBOT/NAME` in missions."""

    names: frozenset[str] = frozenset()
    services: Mapping[str, str] = field(default_factory=dict)  # with their ROS types
    skills: tuple[SkillSource, ...] = ()


NOTHING = Outside()
