"""The data that examinations use, collected beforehand by code that may open a bus and read the machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path

from rbxcompose.bus.graph import Graph
from rbxcompose.dataclass import dataclass
from rbxcompose.devices.serial_ports import SerialPort
from rbxcompose.model.robot import Robot
from rbxcompose.runtime.folder import RobotFolder, RobotState
from rbxcompose.runtime.processes import Process


@dataclass(frozen=True, slots=True)
class BusFacts:
    """The participants of a robot's bus, and the minimum age of the nodes' stamps [s], by node."""

    graph: Graph
    ages: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RunningRobot:
    """A robot that is up, or the remains of one.

    `problem` is why its state cannot be read, `robot` is what its file describes now; `bus` is None if it cannot be
    reached.
    """

    folder: RobotFolder
    state: RobotState | None
    problem: str = ""
    robot: Robot | None = None
    bus: BusFacts | None = None

    @property
    def name(self) -> str:
        """Return the robot's name."""
        return self.folder.path.name


@dataclass(frozen=True, slots=True)
class ResourceLimits:
    """The limits of this user's processes; None means no limit. Sizes in bytes."""

    open_files: int | None
    real_time_priority: int | None
    locked_memory: int | None
    shared_memory: int | None  # free space; None if there is none


@dataclass(frozen=True, slots=True)
class Clocks:
    """The wall clock [s since the epoch], and its step against the monotonic clock during the examination [s].

    `is_synchronised` says whether the kernel follows a time server; None if unknown. `oldest` is a time that has surely
    passed.
    """

    wall: float
    step: float
    is_synchronised: bool | None
    oldest: float


@dataclass(frozen=True, slots=True)
class Listener:
    """A listener at a TCP port; the process is unknown if it belongs to another user."""

    pid: int | None
    title: str


@dataclass(frozen=True, slots=True)
class Version:
    """A package, with its installed and its locked version; None where there is none."""

    name: str
    installed: str | None
    locked: str | None


@dataclass(frozen=True, slots=True)
class HostFacts:
    """All facts. `file` is the named robot, which need not be up; `processes` are this user's titled processes.

    `latencies` are the latency timers of USB adapters [s], by the paths of their ports; `ports` are plugged in.
    """

    running: Sequence[RunningRobot]
    file: Robot | None
    python: str
    versions: Sequence[Version]
    clocks: Clocks
    limits: ResourceLimits
    listeners: Mapping[int, Listener]
    processes: Mapping[Process, str]
    base: Path
    latencies: Mapping[str, float] = field(default_factory=dict)
    ports: Sequence[SerialPort] = ()

    @property
    def robots(self) -> list[Robot]:
        """Return the robots that the files describe, of all that are examined."""
        return [robot for robot in (self.file, *(one.robot for one in self.running)) if robot is not None]
