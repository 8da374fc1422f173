"""Requests of people and tools to a supervisor."""

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Command, Query
from rbxcompose.runtime.folder import RobotState

ROBOT = "robot"


@dataclass(frozen=True, slots=True)
class RobotStatus(Query[RobotState]):
    """Query what is known about the robot from outside."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class StopRobot(Command):
    """Hold everything that moves until the release."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class ReleaseRobot(Command):
    """Allow motion again."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class BringDown(Command):
    """Bring the robot to rest and shut it down."""

    about = ROBOT
