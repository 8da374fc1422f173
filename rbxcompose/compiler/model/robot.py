"""The typed model of a whole robot: its components with their wires, its skills, values and missions."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import Any, Self, TypeVar

from rbxcompose.base.config import COMPONENT, DEFAULT, PLACE, Bound, Config, Place, Restart
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.base.findings import NAMES, WIRING, Span
from rbxcompose.base.levels import Level
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.compiler.doubts import doubts_of
from rbxcompose.compiler.sections.values import unknown_place, values
from rbxcompose.manifest.fill import OpenNames
from rbxcompose.manifest.registry import naming_in_use, section_named, sections_in_use
from rbxcompose.manifest.section import Section
from rbxcompose.manifest.tree import Entry, KeyPath, ScalarNode, all_nodes, at, entries_of, key_span, value_span
from rbxcompose.missions.analysis.facts import settings_of
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.sources import SkillSource, TopicSource, ValueSource, events_of
from rbxcompose.msgs import registry
from rbxcompose.sdk.capabilities import Capability
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import In, Out, Port, Serves, ServesAction


@dataclass(frozen=True, slots=True)
class PortEnd:
    """A port of an instance, and its absolute ROS name; empty for a look-up."""

    instance: str
    name: str
    port: Port[Any]
    topic: str

    @property
    def type_name(self) -> str:
        """Return the ROS name of the port's type; empty for a look-up."""
        return self.port.interface.TYPE if self.port.interface else ""

    @property
    def skill(self) -> str:
        """Return the name that a skill served here has in missions; empty if they do not have it."""
        named = self.port.skill if isinstance(self.port, Serves | ServesAction) else ""
        return "" if named is None else named or self.topic.rpartition("/")[-1]


def resolve(topic: str, namespace: str) -> str:
    """Return a topic's absolute name: relative ones are in the robot's namespace."""
    if topic.startswith("/") or not topic:
        return topic
    return f"/{namespace.strip('/')}/{topic}" if namespace.strip("/") else f"/{topic}"


def ends_of(
    instance: str, cls: type[Component[Any]], config: Config, namespace: str, connect: Mapping[str, str]
) -> tuple[PortEnd, ...]:
    """Return the ends of an instance; `connect` gives ports a topic other than that of their type."""
    return tuple(
        PortEnd(instance, name, port, resolve(connect.get(name, port.topic), namespace))
        for name, port in sorted(cls.ports(config).items())
    )


@dataclass(frozen=True, slots=True)
class Outside:
    """What other robots give, by absolute names; their skills are called `ROBOT/NAME` in missions."""

    names: frozenset[str] = frozenset()
    services: Mapping[str, str] = field(default_factory=dict)  # with their ROS types
    skills: tuple[SkillSource, ...] = ()

    def understood(self) -> "Outside":
        """Return what the robot being read can use of it: that whose types it has, too."""
        if not (self.services or self.skills):
            return self
        known = {*registry.names("srv"), *registry.names("action")}
        services = {name: type_ for name, type_ in self.services.items() if type_ in known}
        return Outside(self.names, services, tuple(source for source in self.skills if source.action in known))


NOTHING = Outside()


K = TypeVar("K", bound=Capability)
ENTRY = 2  # length of the path of an entry: section and name


@dataclass(frozen=True, slots=True)
class RobotComponent:
    """Everything that runs under one name in `ps`; `path` is where the manifest requests it, empty if nowhere.

    One whose configuration has mistakes is not sound: its ports are known, but not what it can do.
    """

    name: str
    type_name: str
    cls: type[Component[Any]]
    config: Config
    process: str
    starts_after: tuple[str, ...]
    ends: tuple[PortEnd, ...]
    path: KeyPath = ()
    restart: Restart = DEFAULT
    log: Level = Level.OK  # the lowest level that is logged
    capabilities: tuple[Capability, ...] = ()
    places: Mapping[str, KeyPath] = field(default_factory=dict)  # of fields and ports that are written elsewhere
    is_sound: bool = True
    bounds: Mapping[str, tuple[Bound, ...]] = field(default_factory=dict)  # of live settings, from arguments
    _by_port: dict[str, PortEnd] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_by_port", {end.name: end for end in self.ends})

    def configured(self, config: Config) -> Self:
        """Return it with another configuration, and what it can do by that."""
        return (
            self if config == self.config else replace(self, config=config, capabilities=self.cls.capabilities(config))
        )

    def end(self, port: str) -> PortEnd | None:
        """Return the end of a port, or None."""
        return self._by_port.get(port)

    def place(self, field: str) -> KeyPath:
        """Return where the manifest has a field of the configuration, or would have it."""
        keys = field.split(".")
        for length in range(len(keys), 0, -1):
            if (there := self.places.get(".".join(keys[:length]))) is not None:
                return (*there, *keys[length:])
        return (*self.path, *keys)

    def declared(self, kind: type[K]) -> list[K]:
        """Return the capabilities of a kind."""
        return [capability for capability in self.capabilities if isinstance(capability, kind)]


@dataclass(frozen=True, slots=True)
class RobotMission:
    """A mission of the robot: its program and the inputs that the robot gives to it."""

    name: str
    program: Program
    inputs: Mapping[str, object] = field(default_factory=dict)
    given: Mapping[str, Span] = field(default_factory=dict)
    """The places of the values that inputs are given instead of their defaults."""


@dataclass(frozen=True, eq=False)
class Robot:
    """The subject of the checks; components are in the order of the manifest."""

    manifest: RobotManifest
    components: Mapping[str, RobotComponent]
    values: Mapping[str, ValueSource]
    skills: Mapping[str, SkillSource]
    missions: Mapping[str, RobotMission]
    unread: frozenset[str] = frozenset()  # missions that no other can use: unread, or in a cycle
    topics: Mapping[str, TopicSource] = field(default_factory=dict)  # that missions may publish on
    services: Mapping[str, str] = field(default_factory=dict)  # that missions may call, with their ROS types
    outside: Outside = NOTHING

    @cached_property
    def settings(self) -> Mapping[str, Mapping[str, Type]]:
        """Return the types of the settings that missions change in components, and of all others that are live there.

        Without a mission that changes any, nothing: looking at all takes time.
        """
        if not any(settings_of(mission.program.nodes) for mission in self.missions.values()):
            return {}
        from rbxcompose.sdk.parameters import live_types  # with messages that few robots need for a check

        return {name: types for name, component in self.components.items() if (types := live_types(component.config))}

    @cached_property
    def names(self) -> RobotNames:
        """Return the names that the robot gives to its missions."""
        return RobotNames(
            values=self._types_of_values(),
            places=places_of(self.manifest),
            removed=self.manifest.history.removed("places"),
            skills={name: source.skill for name, source in self.skills.items()},
            missions={name: mission.program for name, mission in self.missions.items() if name not in self.unread},
            topics={name: topic.message for name, topic in self.topics.items()},
            services=self.services,
            settings=self.settings,
            unread=self.unread,
            events=events_of(self.values),
            is_complete=self.is_complete,
            may_have=self.manifest.contents.may_have,
        )

    def _types_of_values(self) -> dict[str, Type]:
        written = values.names_in(self.manifest.root)
        return {name: self.values[name].type if name in self.values else UNKNOWN for name in written}

    @cached_property
    def is_complete(self) -> bool:
        """Return whether all its components with their ports could be read."""
        return not doubts_of(self.manifest, self.manifest.contents.documents.report).bar((WIRING, NAMES))

    @cached_property
    def written(self) -> frozenset[str]:
        """Return the names of all components that sections of the manifest request, including those with mistakes."""
        return frozenset(name for section in naming_in_use(COMPONENT) for name in section.names_in(self.manifest.root))

    @cached_property
    def brought(self) -> frozenset[str]:
        """Return the names of components that sections bring because they are there, including those with mistakes."""
        return frozenset(name for one in sections_in_use() if one.name in self.manifest.root for name in one.brings)

    @cached_property
    def writers(self) -> Mapping[str, list[PortEnd]]:
        """Return the publishers by topic."""
        return _by_topic(end for end in self.ends if isinstance(end.port, Out))

    @cached_property
    def readers(self) -> Mapping[str, list[PortEnd]]:
        """Return the subscribers by topic."""
        return _by_topic(end for end in self.ends if isinstance(end.port, In))

    @property
    def ends(self) -> Iterator[PortEnd]:
        """Yield the ends of all components."""
        for component in self.components.values():
            yield from component.ends

    def declared(self, kind: type[K]) -> list[tuple[RobotComponent, K]]:
        """Return the capabilities of a kind, each with the component that declares it."""
        if kind not in self._by_capability:
            components = self.components.values()
            self._by_capability[kind] = [
                (component, one) for component in components for one in component.declared(kind)
            ]
        return [*self._by_capability[kind]]

    @cached_property
    def _by_capability(self) -> dict[type, list[tuple[RobotComponent, Any]]]:
        """Return what `declared` has found so far: many rules ask for the same."""
        return {}

    def key(self, *path: str | int) -> Span:
        """Return the place of a key of the composed manifest, or of the nearest one above it."""
        return key_span(self.manifest.root, path)

    def value(self, *path: str | int) -> Span:
        """Return the place of a value of the composed manifest, or of the nearest one above it."""
        return value_span(self.manifest.root, path)

    def end_span(self, end: PortEnd) -> Span:
        """Return the place where a port is connected, else that of the name of its component."""
        component = self.components[end.instance]
        if end.name in component.places:
            return self.key(*component.places[end.name])
        path = (*component.path, "connect", end.name)
        return self.key(*path) if at(self.manifest.root, path) is not None else self.component_span(end.instance)

    def value_span_of(self, name: str, *texts: str) -> Span | None:
        """Return where the entry of a component has one of these values; None if that is in the part that brings it."""
        own, entry = self.components[name].path, self.entry_span(name)
        nodes = all_nodes(there) if own and (there := at(self.manifest.root, own)) is not None else ()
        spans = (node.span for node in nodes if isinstance(node, ScalarNode) and node.text in texts)
        is_own = entry == self.component_span(name)
        return next((span for span in spans if is_own or span.file != self.component_span(name).file), None)

    def connection(self, wanted: Iterable[tuple[PortEnd, str]]) -> str:
        """Return what to write so that ports of one component have other topics; nothing if that cannot be."""
        inside = resolve("x", self.manifest.bus.namespace or "").removesuffix("x")
        given, renamed = [], []
        for end, topic in wanted:
            place = self.components[end.instance].places.get(end.name)
            if place is None and self._takes_connect(self.components[end.instance].path):
                renamed.append(f"{end.name}: {topic.removeprefix(inside)}")
            elif place is not None and len(place) > ENTRY:
                given.append(f"'{'.'.join(map(str, place[ENTRY:]))}: {topic.removeprefix(inside)}'")
        return ", ".join([*given, *([f"'connect: {{{', '.join(renamed)}}}'"] if renamed else [])])

    def _takes_connect(self, path: KeyPath) -> bool:
        """Return whether the entry that requests a component may have the key `connect`."""
        return any("connect" in section.keys_of(entry) for section, entry in self._requesting(path))

    def is_renamed(self, end: PortEnd) -> bool:
        """Return whether `connect:` of an instance may name the topic of a port of a component in its part."""
        component = self.components[end.instance]
        topics = (one.topics(component.name, entry.value) for one, entry in self._requesting(component.path))
        return self._takes_connect(component.path) or end.name in component.places or any(map(any, topics))

    def _requesting(self, path: KeyPath) -> Iterator[tuple[Section[Any, Any], Entry]]:
        """Yield the entry that requests a component, with its section; none if a section as a whole does so."""
        section = section_named(path[0]) if len(path) == ENTRY else None
        entry = entries_of(at(self.manifest.root, path[:1])).get(str(path[-1])) if section else None
        if section and entry:
            yield section, entry

    def parted(self, what: str, *ways: Collection[tuple[PortEnd, str]]) -> str:
        """Return what tells two components apart: to give the ports of one `what`, the first way that can be written.

        Nothing if there is none.
        """
        found = ((way, fix) for way in ways if (fix := self.connection(way)))
        return next((f"give '{end.instance}' {what}: {fix}" for [(end, _), *_], fix in found), "")

    def component_span(self, name: str) -> Span:
        """Return the place of the name of a component."""
        return key_span(self.manifest.root, self.components[name].path)

    def entry_span(self, name: str, port: str = "") -> Span:
        """Return the place of the robot's entry that brings a component: its own, or the one that includes it.

        A port may come from an entry of its own.
        """
        brought = (part.span for part in self.manifest.parts.values() if name in part.components)
        place = self.components[name].places.get(port, ())
        return next(brought, None) or (self.key(*place[:ENTRY]) if place else self.component_span(name))


def places_of(manifest: RobotManifest) -> Mapping[str, Place]:
    """Return the places, also those that could not be read."""
    contents = manifest.contents
    if PLACE not in contents.open_kinds and not contents.stray and not contents.is_unread(PLACE):
        return manifest.places
    return OpenNames(manifest.places, lambda name: contents.may_have(PLACE, name), unknown_place)


def _by_topic(ends: Iterable[PortEnd]) -> Mapping[str, list[PortEnd]]:
    found: dict[str, list[PortEnd]] = {}
    for end in ends:
        found.setdefault(end.topic, []).append(end)
    return found
