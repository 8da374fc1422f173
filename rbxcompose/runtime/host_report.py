"""What the supervisors of a robot's hosts tell each other, several times a second."""

from __future__ import annotations

from dataclasses import field

from rbxcompose.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class RobotEnd:
    """The robot goes down as a whole: its exit code, and why."""

    exit_code: int
    reason: str


@dataclass(frozen=True, slots=True)
class HostReport:
    """How one host is: `version` changes with the robot's files, `run` with each start, which the supervisor knows."""

    host: str
    version: str
    run: str = ""
    is_going_down: bool = False
    states: dict[str, str] = field(default_factory=dict)  # of its components
    end: RobotEnd | None = None
