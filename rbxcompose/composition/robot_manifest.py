"""The robot as the front end returns it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from enum import StrEnum
from pathlib import Path

from rbxcompose.body.description import Description
from rbxcompose.composition.argument_bounds import ScopedBounds, bounds_of
from rbxcompose.composition.history import History
from rbxcompose.composition.inclusions import Inclusions
from rbxcompose.config import Bound, Place
from rbxcompose.dataclass import dataclass
from rbxcompose.diagnostics.settings import DiagnosticsModel
from rbxcompose.findings import Span
from rbxcompose.manifest.section import Contents
from rbxcompose.manifest.tree import KeyPath, MappingNode
from rbxcompose.sections.body import body
from rbxcompose.sections.bus import BusModel, bus
from rbxcompose.sections.components import ComponentEntry, components
from rbxcompose.sections.diagnostics import diagnostics
from rbxcompose.sections.missions import MissionEntry, missions
from rbxcompose.sections.muxes import MuxModel, muxes
from rbxcompose.sections.places import places
from rbxcompose.sections.process import process
from rbxcompose.sections.start import start
from rbxcompose.sections.values import ValueModel, values


class About(StrEnum):
    """The subject of a part's claim."""

    NEED = "a topic that it needs"
    PORT = "a topic that it gives"
    SKILL = "a skill"
    VALUE = "a value"


@dataclass(frozen=True, slots=True)
class Claim:
    """One thing that a part needs or provides, by its name in the robot; `type` is that of a topic."""

    about: About
    name: str
    type: str
    span: Span


@dataclass(frozen=True, slots=True)
class IncludedPart:
    """An instance of a part: what it brought, by its names in the robot.

    `name` is the path of the instance (`arm.hand`); what a part includes belongs to it, too.
    """

    name: str
    file: str  # file name in findings
    span: Span  # span of the entry that includes it
    components: frozenset[str]
    muxes: frozenset[str]  # those to which it adds an input or a lock
    values: frozenset[str]
    claims: tuple[Claim, ...]  # what it needs and provides


@dataclass(frozen=True, slots=True)
class RobotManifest:
    """A robot after composition: everything in its file, in the order of the file."""

    name: str
    about: str
    path: Path
    root: MappingNode  # composed and filled; the places of everything below
    is_simulated: bool
    contents: Contents
    parts: Mapping[str, IncludedPart] = field(default_factory=dict)
    profiles: Mapping[str, Span] = field(default_factory=dict)  # from the name to the end of what it changes
    include: MappingNode = field(default_factory=MappingNode)  # composed; the parts that it names are already in `root`
    history: History = field(default_factory=History)
    overlays: tuple[str, ...] = ()  # the files of `-f`, by their names in findings
    files: Mapping[str, Path] = field(default_factory=dict)  # every file that was read, by its shown name
    inclusions: Inclusions = field(default_factory=Inclusions)
    bounds: ScopedBounds = field(default_factory=dict)  # of arguments, by scope and name

    def bounds_at(self, path: KeyPath) -> tuple[Bound, ...]:
        """Return what bounds the value at a path beside its type: those of the argument that it is taken from."""
        steps = self.history.of(path)
        return bounds_of(steps[-1].node, self.bounds) if steps else ()

    @property
    def components(self) -> Mapping[str, ComponentEntry]:
        """Return the components that the user wrote."""
        return self.contents.of(components)

    @property
    def muxes(self) -> Mapping[str, MuxModel]:
        """Return the muxes."""
        return self.contents.of(muxes)

    @property
    def places(self) -> Mapping[str, Place]:
        """Return the places."""
        return self.contents.of(places)

    @property
    def values(self) -> Mapping[str, ValueModel]:
        """Return the values."""
        return self.contents.of(values)

    @property
    def missions(self) -> Mapping[str, MissionEntry]:
        """Return the missions."""
        return self.contents.of(missions)

    @property
    def diagnostics(self) -> DiagnosticsModel:
        """Return the groups of the components' diagnostics."""
        return self.contents.of(diagnostics)

    @property
    def bus(self) -> BusModel:
        """Return the settings of the bus."""
        return self.contents.of(bus)

    @property
    def process(self) -> str | None:
        """Return the process group of components that do not name their own, if the robot has one."""
        return self.contents.of(process)

    @property
    def body(self) -> Description | None:
        """Return the description of the body."""
        return self.contents.of(body)

    @property
    def start(self) -> str | None:
        """Return the mission to start; None also if that mission has mistakes, which are already reported."""
        return self.contents.of(start)
