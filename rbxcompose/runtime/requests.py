"""Requests of people and tools to a supervisor."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Command, Query
from rbxcompose.runtime.folder import RobotState

ROBOT = "robot"


@dataclass(frozen=True, slots=True)
class RobotStatus(Query[RobotState]):
    """Query what is known about the robot from outside."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class PortDescription:
    """A port of a component: its `kind` (`in`, `out`, `serves`, ...), and the absolute name and type at its other end.

    `skill` is the name that a skill has in missions; the rest is as in `sdk.ports`, empty where it does not apply.
    """

    name: str
    kind: str
    topic: str
    type: str
    unit: str = ""
    skill: str = ""
    is_command: bool = False
    """Whether a publisher of it moves the robot."""
    claims: str = ""
    is_pausable: bool = False
    measures: Mapping[str, Any] = field(default_factory=dict)
    """Units of numbers of a goal, as deep as its messages are nested."""
    choices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    outcomes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ComponentDescription:
    """A component as its type declares it, for people and their tools.

    `capabilities` are fields by the name of the capability: names of ports, and values in SI. `requests` are those that
    it takes, with whether they are commands.
    """

    name: str
    type: str
    about: str
    process: str
    ports: tuple[PortDescription, ...]
    capabilities: Mapping[str, tuple[Mapping[str, Any], ...]]
    requests: Mapping[str, bool]


@dataclass(frozen=True, slots=True)
class DescribeRobot(Query[tuple[ComponentDescription, ...]]):
    """Query what the robot is made of."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class StopRobot(Command):
    """Hold everything that moves until the release; `by` says who wants that."""

    about = ROBOT
    by: str = "the command 'stop'"


@dataclass(frozen=True, slots=True)
class ReleaseRobot(Command):
    """Allow motion again."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class NoteInLog(Command):
    """Write into the robot's log what somebody does with it."""

    about = ROBOT
    text: str


@dataclass(frozen=True, slots=True)
class BringDown(Command):
    """Bring the robot to rest and shut it down."""

    about = ROBOT
