"""What an engine says while a mission runs: typed events, of which a shell makes the robot's story."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rbxcompose.expressions.values import Value


@dataclass(frozen=True, slots=True)
class SkillStarted:
    """A skill was started; `leaf` is the number of its node."""

    leaf: int
    skill: str
    arguments: Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class SkillEnded:
    """A skill ended by itself (`success`, `failure`) or was `halted`, after `duration` [s]."""

    leaf: int
    skill: str
    result: str
    duration: float
    message: str = ""


@dataclass(frozen=True, slots=True)
class InterruptStarted:
    """A condition of `interrupts:` holds; `shown` are the values that it read, as text."""

    name: str
    condition: str
    shown: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class InterruptEnded:
    """The reaction is done; the leaves that it halted start again."""

    name: str
    back_to: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Logged:
    """A `log` node spoke; the level is `info`, `warn` or `error`."""

    level: str
    text: str


@dataclass(frozen=True, slots=True)
class Reported:
    """Something is wrong with the mission at the node with this path."""

    path: str
    message: str


@dataclass(frozen=True, slots=True)
class MissionEnded:
    """The mission ended in `success` or `failure`, or was `halted` from outside."""

    result: str
    message: str = ""


MissionEvent = SkillStarted | SkillEnded | InterruptStarted | InterruptEnded | Logged | Reported | MissionEnded
