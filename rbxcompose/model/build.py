"""From the manifest to the robot: sections become components, ports become ends of wires, actions become skills.

Parts that do not fit together are left out here; the checks report them.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Collection, Mapping
from dataclasses import field, replace

from rbxcompose.composition.robot_manifest import RobotManifest
from rbxcompose.config import Config, is_live, key_of, leaves
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report
from rbxcompose.levels import LOG_LEVELS
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import ROBOT, Contents
from rbxcompose.manifest.tree import at
from rbxcompose.manifest.wanted_components import WantedComponent
from rbxcompose.missions.analysis.effects import sent_by, settings_of
from rbxcompose.missions.program.sources import ValueSource
from rbxcompose.model.missions import read_missions
from rbxcompose.model.outside import NOTHING, Outside
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.model.skills import names_of_skills, services_of, skills_of, topics_of
from rbxcompose.model.values import value_of
from rbxcompose.model.wires import ends_of, resolve
from rbxcompose.sdk.capabilities import Drives, require_declared
from rbxcompose.sdk.ports import In, Out
from rbxcompose.sdk.registry import component_type

MISSION = "mission"
CHANGE = "rbxcompose_parameters/srv/ChangeParameters"  # of a setting, by a mission
ALWAYS = ("transforms", "diagnostics")  # the components of every robot


def build_robot(
    manifest: RobotManifest,
    *,
    environment: Mapping[str, str],
    report: Report,
    sources: dict[str, str],
    outside: Outside = NOTHING,
) -> Robot:
    """Return the whole robot, with what it has of others; errors in its mission files go into `report`."""
    written = written_components(manifest)
    components = {**written, **own_components(manifest, written)}
    values, topics, services = (
        values_of(manifest, components),
        topics_of(manifest, components),
        services_of(manifest, components),
    )
    missions = read_missions(manifest, environment, report, sources, names_of_skills(components, outside))
    skills = skills_of(components, [one.program for one in missions.read.values()], outside)
    changed = settings_of(node for one in missions.read.values() for node in one.program.nodes)
    services |= {one.service: CHANGE for one in changed if one.component.text in components} | {**outside.services}
    robot = Robot(manifest, components, values, skills, missions.read, missions.unread, topics, services, outside)
    if manifest.missions:
        components[MISSION] = mission_component(robot)
    return robot


def with_missions(robot: Robot, names: Collection[str]) -> Robot:
    """Return a robot that has no missions but these."""
    missions = {name: one for name, one in robot.missions.items() if name in names}
    left = replace(robot, missions=missions, unread=frozenset())
    runs = {MISSION: mission_component(left)} if MISSION in robot.components else {}
    return replace(left, components={**robot.components, **runs})


def written_components(manifest: RobotManifest) -> dict[str, RobotComponent]:
    """Return the wired components that the sections request: first those named by users, then those of sections."""
    wires = _Wires(manifest.bus.namespace or "")
    given = _given_topics(manifest.contents)
    for section in sorted(sections(ROBOT), key=lambda one: not one.names):
        for wanted in section.components(manifest.contents, wires):
            wires.add(_component(manifest, wanted, given.get(wanted.name, {})))
    return wires.components


def _given_topics(contents: Contents) -> dict[str, dict[str, str]]:
    """Return the topics that sections give to ports of components: component -> port -> topic."""
    found: dict[str, dict[str, str]] = {}
    for section in sections(ROBOT):
        for component, topics in section.connects(contents).items():
            found.setdefault(component, {}).update(topics)
    return found


@dataclass(frozen=True, slots=True)
class _Wires:
    """The wires of the components known so far."""

    namespace: str
    components: dict[str, RobotComponent] = field(default_factory=dict)
    _read: dict[str, str] = field(default_factory=dict)  # topic -> type of its first subscriber
    _written: list[tuple[str, int, str]] = field(default_factory=list)  # topic, number, type of publishers, sorted

    def add(self, component: RobotComponent) -> None:
        """Add a component and its ends."""
        self.components[component.name] = component
        for end in component.ends:
            if isinstance(end.port, In):
                self._read.setdefault(end.topic, end.type_name)
            elif isinstance(end.port, Out):
                insort(self._written, (end.topic, len(self._written), end.type_name))

    def message_of(self, topic: str) -> str:
        """Return the type of a subscriber of a topic, else of a publisher below it; empty if there is none."""
        name = resolve(topic, self.namespace)
        if name in self._read:
            return self._read[name]
        first = bisect_left(self._written, (f"{name}/",))
        last = bisect_left(self._written, (f"{name}0",))  # "0" follows "/"
        _, message = min((one[1:] for one in self._written[first:last]), default=(0, ""))
        return message

    def drives(self, topic: str) -> bool:
        """Return whether a base follows the commands on a topic."""
        name = resolve(topic, self.namespace)
        return any(
            end is not None and end.topic == name
            for component in self.components.values()
            for end in (component.end(one.commands) for one in component.declared(Drives))
        )


def own_components(manifest: RobotManifest, written: Mapping[str, RobotComponent]) -> dict[str, RobotComponent]:
    """Return the components that every robot runs, except the one that runs missions."""
    names = [*written, *ALWAYS, *([MISSION] if manifest.missions else [])]
    groups = manifest.diagnostics
    settings = {name: getattr(groups, name) for name in groups.model_fields_set}
    return {
        "transforms": _own(manifest, "transforms", {"urdf": manifest.body.text if manifest.body else ""}),
        "diagnostics": _own(manifest, "diagnostics", {**settings, "expected": names}),
    }


def mission_component(robot: Robot) -> RobotComponent:
    """Return the component that runs the missions."""
    manifest, missions = robot.manifest, robot.missions
    programs = {name: mission.program for name, mission in missions.items()}
    published, called = sent_by(programs.values())
    config = {
        "programs": programs,
        "start": manifest.start if manifest.start in missions else None,
        "inputs": {name: dict(mission.inputs) for name, mission in missions.items()},
        "values": robot.values,
        "places": manifest.places,
        "skills": robot.skills,
        "topics": {name: topic for name, topic in robot.topics.items() if name in published},
        "services": {name: service for name, service in robot.services.items() if name in called},
        "settings": {name: types for name, types in robot.settings.items() if f"{name}/change_parameters" in called},
    }
    return _own(manifest, MISSION, config)


def _own(manifest: RobotManifest, type_name: str, config: Mapping[str, object]) -> RobotComponent:
    """Return a component named after its type, placed at the manifest section of that name."""
    return _component(manifest, WantedComponent(type_name, type_name, config, (type_name,)), {})


def _component(manifest: RobotManifest, wanted: WantedComponent, given: Mapping[str, str]) -> RobotComponent:
    """Return the component that was requested; `given` are topics that others assign to its ports."""
    cls, options = component_type(wanted.type_name), wanted.options
    config = wanted.config if isinstance(wanted.config, Config) else cls.config_type()(**wanted.config)
    ends = ends_of(wanted.name, cls, config, manifest.bus.namespace or "", {**options.connect, **given})
    process = options.process or manifest.process or cls.process
    log = LOG_LEVELS[options.log]
    names = (end.name for end in ends)
    capable = cls.capabilities(config) if wanted.is_sound else ()
    capabilities = require_declared(wanted.type_name, capable, names, type(config))
    made = RobotComponent(
        wanted.name,
        wanted.type_name,
        cls,
        config,
        process,
        options.starts_after,
        ends,
        wanted.path,
        options.restart,
        log,
        capabilities,
        wanted.places,
        wanted.is_sound,
    )
    live = (name for name, one in leaves(config) if is_live(one))
    bounds = {name: manifest.bounds_at(made.place(key_of(config, name))) for name in live}
    return replace(made, bounds={name: each for name, each in bounds.items() if each})


def values_of(manifest: RobotManifest, components: Mapping[str, RobotComponent]) -> dict[str, ValueSource]:
    """Return the values whose source exists."""
    types: dict[str, str] = {}  # by topic
    for end in (end for component in components.values() for end in component.ends if end.type_name):
        types.setdefault(end.topic, end.type_name)
    namespace, groups = manifest.bus.namespace or "", manifest.diagnostics.headers
    entries = {  # not those whose type is a mistake, which is told
        name: entry
        for name, entry in manifest.values.items()
        if entry.type is not None or at(manifest.root, ("values", name, "type")) is None
    }
    found = {name: value_of(entry, components, types, namespace, groups) for name, entry in entries.items()}
    return {name: value for name, value in found.items() if value is not None}
