"""What the executive needs from the component that it runs in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.program.sources import SkillSource, TopicSource, ValueSource

# Prefixes of port names.
VALUE, PUBLISHES, CALLS = "value_", "publishes_", "calls_"
SKILL, PAUSES, ENDS, HALTS = "skill_", "pauses_", "ends_", "halts_"  # of a skill: requests, pauses, ends, cancels


class Equipment(Protocol):
    """The robot's missions, and what they may request of it."""

    @property
    def programs(self) -> Mapping[str, Program]:
        """Return the missions by name."""
        ...

    @property
    def inputs(self) -> Mapping[str, Mapping[str, Any]]:
        """Return the robot's values for inputs, by mission and name."""
        ...

    @property
    def values(self) -> Mapping[str, ValueSource]:
        """Return the sources of values."""
        ...

    @property
    def skills(self) -> Mapping[str, SkillSource]:
        """Return the skills."""
        ...

    @property
    def topics(self) -> Mapping[str, TopicSource]:
        """Return the topics on which missions publish."""
        ...

    @property
    def services(self) -> Mapping[str, str]:
        """Return the services that missions call, with their ROS types."""
        ...

    @property
    def reads(self) -> frozenset[str]:
        """Return the names that any mission reads."""
        ...

    @property
    def used(self) -> Mapping[str, SkillSource]:
        """Return the skills that any mission uses."""
        ...

    @property
    def names(self) -> RobotNames:
        """Return what the robot gives to missions."""
        ...


class Shell(Protocol):
    """The component: its time, its live ports by name, its log."""

    bound: dict[str, Any]

    @property
    def equipment(self) -> Equipment:
        """Return the robot's missions and what they may request of it."""
        ...

    @property
    def now(self) -> float:
        """Return robot time [s]."""
        ...

    def info(self, text: str) -> None:
        """Log an event."""
        ...

    def warn(self, text: str) -> None:
        """Log something that a person should look at."""
        ...

    def look_soon(self) -> None:
        """Request to be woken at this instant."""
        ...


def port_name(beginning: str, topic: str) -> str:
    """Return the name of the port for a topic or a service."""
    return beginning + topic.strip("/").replace("/", "_")
