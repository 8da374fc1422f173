"""What people and tools may ask of a supervisor."""

from __future__ import annotations

from dataclasses import dataclass

from rbxcompose.requests import Command, Query
from rbxcompose.runtime.folder import RobotState

ROBOT = "robot"


@dataclass(frozen=True, slots=True)
class RobotStatus(Query[RobotState]):
    """Ask what is known of the robot from outside."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class StopRobot(Command):
    """Hold everything that moves, until the release."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class ReleaseRobot(Command):
    """Allow motion again."""

    about = ROBOT


@dataclass(frozen=True, slots=True)
class BringDown(Command):
    """Bring the robot to rest and end it."""

    about = ROBOT
