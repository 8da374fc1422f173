"""The typed model of a whole robot: its parts with their wires, its skills, values and missions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from rbxcompose.composition.robot_manifest import RobotManifest
from rbxcompose.config import Config
from rbxcompose.expressions.types import UNKNOWN
from rbxcompose.findings import Span
from rbxcompose.levels import Level
from rbxcompose.manifest.registry import naming
from rbxcompose.manifest.tree import Path, at, key_span, value_span
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.program.sources import SkillSource, TopicSource, ValueSource
from rbxcompose.model.wires import End
from rbxcompose.references import COMPONENT
from rbxcompose.restarts import DEFAULT, Restart
from rbxcompose.sdk.capabilities import Capability
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import In, Out

K = TypeVar("K", bound=Capability)


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
    log: Level = Level.OK  # the least of what goes to the log
    capabilities: tuple[Capability, ...] = ()

    def end(self, port: str) -> End | None:
        """Return the end of a port, or None."""
        return next((end for end in self.ends if end.name == port), None)

    def declared(self, kind: type[K]) -> list[K]:
        """Return the capabilities of a kind."""
        return [one for one in self.capabilities if isinstance(one, kind)]


@dataclass(frozen=True, slots=True)
class RobotMission:
    """A mission of the robot: its program and the inputs that the robot gives to it."""

    name: str
    program: Program
    inputs: AnyMapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Robot:
    """What the checks look at; parts stand in the order of the manifest."""

    manifest: RobotManifest
    parts: AnyMapping[str, Part]
    values: AnyMapping[str, ValueSource]
    skills: AnyMapping[str, SkillSource]
    missions: AnyMapping[str, RobotMission]
    unread: frozenset[str] = frozenset()  # missions that no other can use: not read, or in a circle
    topics: AnyMapping[str, TopicSource] = field(default_factory=dict)  # on which missions may publish
    services: AnyMapping[str, str] = field(default_factory=dict)  # that missions may call, with their ROS types

    @cached_property
    def names(self) -> RobotNames:
        """Return what the robot gives to its missions."""
        return RobotNames(
            values={name: self.values[name].type if name in self.values else UNKNOWN for name in self.manifest.values},
            places=self.manifest.places,
            removed=self.manifest.history.removed("places"),
            skills={name: source.skill for name, source in self.skills.items()},
            missions={name: one.program for name, one in self.missions.items() if name not in self.unread},
            topics={name: topic.message for name, topic in self.topics.items()},
            services=self.services,
            unread=self.unread,
            is_complete=self.written <= self.parts.keys(),
        )

    @cached_property
    def written(self) -> frozenset[str]:
        """Return the names of all components that sections of the manifest ask for, also of those with mistakes."""
        return frozenset(name for one in naming(COMPONENT) for name in one.names_in(self.manifest.root))

    @cached_property
    def writers(self) -> AnyMapping[str, list[End]]:
        """Return who publishes, by topic."""
        return _by_topic(end for end in self.ends if isinstance(end.port, Out))

    @cached_property
    def readers(self) -> AnyMapping[str, list[End]]:
        """Return who subscribes, by topic."""
        return _by_topic(end for end in self.ends if isinstance(end.port, In))

    @property
    def ends(self) -> Iterator[End]:
        """Yield the ends of all parts."""
        for part in self.parts.values():
            yield from part.ends

    def declared(self, kind: type[K]) -> list[tuple[Part, K]]:
        """Return the capabilities of a kind, each with the part that declares it."""
        return [(part, one) for part in self.parts.values() for one in part.declared(kind)]

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

    def entry_span(self, name: str) -> Span:
        """Return the place of the robot's own entry that brings a part: that of the part, or what includes it."""
        brought = (one.span for one in self.manifest.parts.values() if name in one.components)
        return next(brought, None) or self.part_span(name)


def _by_topic(ends: Iterable[End]) -> AnyMapping[str, list[End]]:
    found: dict[str, list[End]] = {}
    for end in ends:
        found.setdefault(end.topic, []).append(end)
    return found
