"""The typed model of a whole robot: its parts with their wires, its skills, values and missions."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass, field
from typing import Any

from rbxcompose.config import Config
from rbxcompose.expressions.types import UNKNOWN
from rbxcompose.findings import Span
from rbxcompose.manifest.models import RobotManifest
from rbxcompose.manifest.tree import Mapping, Path, at, key_span, value_span
from rbxcompose.missions.program import Program, RobotNames
from rbxcompose.missions.sources import SkillSource, ValueSource
from rbxcompose.model.wiring import End
from rbxcompose.restarts import DEFAULT, Restart
from rbxcompose.sdk.component import Component


@dataclass(frozen=True, slots=True)
class Part:
    """Everything that runs under one name in `ps`; `path` is where the manifest asks for it, empty if nowhere."""

    name: str
    type_name: str
    cls: type[Component[Any]]
    config: Config
    process: str
    starts_after: tuple[str, ...]
    ends: tuple[End, ...]
    path: Path = ()
    restart: Restart = DEFAULT

    def end(self, port: str) -> End | None:
        """Return the end of a port, or None."""
        return next((end for end in self.ends if end.name == port), None)


@dataclass(frozen=True, slots=True)
class RobotMission:
    """A mission of the robot: its program and the inputs that the robot gives to it."""

    name: str
    program: Program
    inputs: AnyMapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Robot:
    """What the checks look at; parts stand in the order of the manifest."""

    manifest: RobotManifest
    parts: AnyMapping[str, Part]
    values: AnyMapping[str, ValueSource]
    skills: AnyMapping[str, SkillSource]
    missions: AnyMapping[str, RobotMission]

    @property
    def names(self) -> RobotNames:
        """Return what the robot gives to its missions."""
        return RobotNames(
            values={name: self.values[name].type if name in self.values else UNKNOWN for name in self.manifest.values},
            places=self.manifest.places,
            skills={name: source.skill for name, source in self.skills.items()},
            is_complete=self.written <= self.parts.keys(),
        )

    @property
    def written(self) -> frozenset[str]:
        """Return the names of all components and muxes that the manifest has, also of those with mistakes."""
        sections = (self.manifest.root.get(section) for section in ("components", "muxes"))
        return frozenset(name for one in sections if isinstance(one, Mapping) for name in one.entries)

    @property
    def ends(self) -> Iterator[End]:
        """Yield the ends of all parts."""
        for part in self.parts.values():
            yield from part.ends

    def key(self, *path: str | int) -> Span:
        """Return the place of a key of the composed manifest, or of the nearest one above it."""
        return key_span(self.manifest.root, path)

    def value(self, *path: str | int) -> Span:
        """Return the place of a value of the composed manifest, or of the nearest one above it."""
        return value_span(self.manifest.root, path)

    def end_span(self, end: End) -> Span:
        """Return the place where a port is connected, else that of the name of its part."""
        path = (*self.parts[end.instance].path, "connect", end.name)
        return self.key(*path) if at(self.manifest.root, path) is not None else self.part_span(end.instance)

    def part_span(self, name: str) -> Span:
        """Return the place of the name of a part."""
        return key_span(self.manifest.root, self.parts[name].path)
