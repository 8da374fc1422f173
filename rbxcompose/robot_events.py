"""What a component reports to its supervisor because it concerns the whole robot."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MissionOver:
    """A mission has ended with `outcome`; with the one that `up` started, the robot may go down."""

    mission: str
    outcome: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class MissionWaits:
    """A mission cannot begin, since a value does not come; `message` says which."""

    mission: str
    message: str


RobotEvent = MissionOver | MissionWaits
