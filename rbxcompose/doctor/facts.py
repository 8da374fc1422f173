"""What examinations look at, as data: collected beforehand by code that may open a bus and read the machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rbxcompose.bus.graph import Graph
from rbxcompose.model.robot import Robot
from rbxcompose.runtime.folder import RobotFolder, RobotState
from rbxcompose.runtime.processes import Process


@dataclass(frozen=True, slots=True)
class BusFacts:
    """Who is on a robot's bus, and by how much its nodes' stamps lie in the past [s], at the least, by node."""

    graph: Graph
    ages: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RunningRobot:
    """A robot that is up, or what is left of one.

    `problem` is why its state cannot be read, `robot` what its file describes now; `bus` is None if it cannot be
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
    """What this user's processes may have; None is no limit. Sizes in bytes."""

    open_files: int | None
    real_time_priority: int | None
    locked_memory: int | None
    shared_memory: int | None  # that is free; None if there is none


@dataclass(frozen=True, slots=True)
class Clocks:
    """The wall clock [s since the epoch], and its step against the monotonic clock while we looked [s].

    `is_synchronised` tells whether the kernel follows a time server; None if it does not say. `oldest` is a time that
    has surely passed.
    """

    wall: float
    step: float
    is_synchronised: bool | None
    oldest: float


@dataclass(frozen=True, slots=True)
class Listener:
    """Who listens at a TCP port; a process of another user is not known."""

    pid: int | None
    title: str


@dataclass(frozen=True, slots=True)
class Version:
    """A package: what is installed and what is locked; None where there is none."""

    name: str
    installed: str | None
    locked: str | None


@dataclass(frozen=True, slots=True)
class HostFacts:
    """Everything. `file` is the robot that was named and need not be up; `processes` are titled ones of this user."""

    running: Sequence[RunningRobot]
    file: Robot | None
    python: str
    versions: Sequence[Version]
    clocks: Clocks
    limits: ResourceLimits
    listeners: Mapping[int, Listener]
    processes: Mapping[Process, str]
    base: Path

    @property
    def robots(self) -> list[Robot]:
        """Return what the files describe, of all robots that are looked at."""
        return [robot for robot in (self.file, *(one.robot for one in self.running)) if robot is not None]
