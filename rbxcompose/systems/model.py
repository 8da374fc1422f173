"""A system after reading: its hosts, and its robots with the host of each component."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cached_property
from pathlib import Path

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report, Span
from rbxcompose.manifest.system_file import HostModel, LinkModel, SystemRobotModel
from rbxcompose.manifest.tree import MappingNode, value_span
from rbxcompose.model.robot import Robot
from rbxcompose.plan.model import Plan
from rbxcompose.systems.placement import Placement
from rbxcompose.systems.traffic import Crossing, TopicEnd, crossings, ends_of


@dataclass(frozen=True, eq=False)
class PlacedRobot:
    """A robot of a system: its plan as if it ran on one host, and where each component runs."""

    name: str
    entry: str  # its key in the system's file; of several instances, the same
    model: SystemRobotModel
    robot: Robot
    plan: Plan
    placed: Mapping[str, Placement]
    link_port: int
    share_port: int
    version: str  # of rbxcompose and the texts that it was compiled from

    @cached_property
    def hosts(self) -> Mapping[str, str]:
        """Return the host of each component."""
        return {name: one.host for name, one in self.placed.items()}

    @cached_property
    def crossings(self) -> tuple[Crossing, ...]:
        """Return what crosses between its hosts."""
        return tuple(crossings(self.plan, self.hosts))

    @cached_property
    def ends(self) -> tuple[TopicEnd, ...]:
        """Return all ends of its components."""
        return tuple(ends_of(self.plan, self.hosts))

    @property
    def labels(self) -> frozenset[str]:
        """Return what it may be called by, with others: its name, that of its instances, and its labels."""
        return frozenset({self.name, self.entry, *self.model.labels})

    def span(self, root: MappingNode, *keys: str | int) -> Span:
        """Return the place of a value of its entry in the system's file."""
        return value_span(root, ("robots", self.entry, *keys))


@dataclass(slots=True)
class System:
    """The result of compiling a system; with errors in the report, robots may be missing."""

    path: Path | None = None
    name: str = ""
    root: MappingNode = field(default_factory=MappingNode)
    security: str = "none"
    hosts: Mapping[str, HostModel] = field(default_factory=dict)
    links: Mapping[str, LinkModel] = field(default_factory=dict)
    robots: dict[str, PlacedRobot] = field(default_factory=dict)
    report: Report = field(default_factory=Report)
    sources: dict[str, str] = field(default_factory=dict)
    profiles: tuple[str, ...] = ()  # those that were chosen
    known_profiles: tuple[str, ...] = ()
