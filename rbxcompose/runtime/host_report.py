"""What the supervisors of a robot's hosts tell each other, several times a second."""

from __future__ import annotations

from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.runtime.clock_offset import ClockOffset


@dataclass(frozen=True, slots=True)
class RobotEnd:
    """The robot goes down as a whole: its exit code, and why."""

    exit_code: int
    reason: str


@dataclass(frozen=True, slots=True)
class StopMark:
    """One stop: the start of the share on which it was ordered, and its number there."""

    run: str
    number: int


@dataclass(frozen=True, slots=True)
class SharedStop:
    """What a host tells of stops: its own and who ordered it, those of others that it has released, and what holds it.

    `holds` are the reasons for which components of this host need the robot to stand still.
    """

    own: StopMark | None = None
    by: str = ""
    released: list[StopMark] = field(default_factory=list)
    holds: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class HostReport:
    """How one host is: `version` changes with the robot's files, `run` with each start of its share."""

    host: str
    version: str
    run: str
    is_going_down: bool = False
    stop: SharedStop = SharedStop()
    states: dict[str, str] = field(default_factory=dict)  # of its components
    end: RobotEnd | None = None
    clock: ClockOffset | None = None  # its clock against that of the host which hears it, which measures it
