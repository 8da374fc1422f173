"""From the manifest to the robot: sections become components, ports become ends of wires, actions become skills."""

from bisect import bisect_left, insort
from collections.abc import Collection, Iterator, Mapping
from dataclasses import field, replace

from pydantic import ValidationError

from rbxcompose.base.config import Config, is_live, key_of, leaves
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Itself, Report, once
from rbxcompose.base.levels import LOG_LEVELS
from rbxcompose.base.plugins import reported
from rbxcompose.compiler.composition.robot_file import read_mission
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.compiler.model.robot import (
    NOTHING,
    Outside,
    Robot,
    RobotComponent,
    RobotMission,
    ends_of,
    places_of,
    resolve,
)
from rbxcompose.compiler.model.skills import names_of_skills, services_of, skills_of, topics_of
from rbxcompose.compiler.model.values import findings_about, triggers_of, value_of
from rbxcompose.compiler.sections.missions import missions
from rbxcompose.manifest import registry as section_registry
from rbxcompose.manifest.registry import sections_in_use
from rbxcompose.manifest.section import ROBOT, Contents, WantedComponent
from rbxcompose.manifest.tree import MappingNode, at, key_span
from rbxcompose.manifest.validate import refusals
from rbxcompose.missions.analysis.facts import sent_by, settings_of
from rbxcompose.missions.engine.inputs import bind_inputs
from rbxcompose.missions.language.reader import Budget, read_program
from rbxcompose.missions.program.linker import Using
from rbxcompose.missions.program.program import Program
from rbxcompose.missions.sources import ValueSource
from rbxcompose.sdk import registry
from rbxcompose.sdk.capabilities import Drives, require_declared
from rbxcompose.sdk.ports import In, Out
from rbxcompose.sdk.registry import component_type


@dataclass(frozen=True, slots=True)
class ReadMissions:
    """The missions that could be read, and the names of those that others cannot `use`: unread, or in a cycle."""

    read: Mapping[str, RobotMission] = field(default_factory=dict)
    unread: frozenset[str] = frozenset()


def read_missions(
    manifest: RobotManifest,
    environment: Mapping[str, str],
    report: Report,
    sources: dict[str, str],
    skills: Collection[str],
    only: str = "",
) -> ReadMissions:
    """Read the robot's mission files; one with mistakes is kept as far as it could be read.

    `skills` are the names of all existing skills; `only` is the one mission to read, all if it is empty.
    """
    found: dict[str, RobotMission] = {}
    budget, there = Budget(), frozenset(skills)
    for name, entry in manifest.missions.items():
        if only and name != only:
            continue
        root = read_mission(
            entry.path,
            robot=manifest.name,
            report=report,
            sources=sources,
            sim=manifest.is_simulated,
            environment=environment,
            span=entry.span,
        )
        if root is None:
            continue
        program, findings, budget = _program(Itself(root), there, budget.held, budget.written)
        report.extend(findings)
        if program is not None:
            gone = manifest.history.removed("places")
            given, is_begun = entry.with_.entries, name == manifest.start and entry.is_sound
            places = places_of(manifest)
            inputs, findings = bind_inputs(program, given, places, entry.span, gone, is_begun=is_begun)
            report.extend(findings)
            written_at = {key: written.value.span for key, written in given.items()}
            found[name] = RobotMission(name, program, inputs, written_at)
    using = Using({name: mission.program for name, mission in found.items()})
    report.extend(using.findings)
    written = frozenset(missions.names_in(manifest.root))
    return ReadMissions(found, frozenset((written - found.keys()) | using.broken))


@once  # a profile rarely changes a mission
def _program(
    root: Itself[MappingNode], skills: frozenset[str], held: int, written: int
) -> tuple[Program | None, list[Finding], Budget]:
    """Return a mission's program, what was found in it, and what is left of a budget."""
    report, left = Report(), Budget(held, written)
    return read_program(root.value, report, skills, left), report.findings, left


MISSION = "mission"
RUN_MISSION = "rbxcompose_msgs/action/RunMission"
CHANGE = "rbxcompose_parameters/srv/ChangeParameters"  # of a setting, by a mission


def build_robot(
    manifest: RobotManifest,
    *,
    environment: Mapping[str, str],
    report: Report,
    sources: dict[str, str],
    outside: Outside = NOTHING,
) -> Robot:
    """Return the whole robot, with what it has of others; errors in its mission files go into `report`."""
    outside = outside.understood()
    written = written_components(manifest, report)
    components = {**written, **own_components(manifest, written)}
    values = values_of(manifest, components)
    topics, services = topics_of(manifest, components), services_of(manifest, components)
    missions = read_missions(manifest, environment, report, sources, names_of_skills(components, outside))
    skills = skills_of(components, [mission.program for mission in missions.read.values()], outside)
    changed = settings_of(node for mission in missions.read.values() for node in mission.program.nodes)
    services |= {setting.service: CHANGE for setting in changed if setting.component.text in components}
    services |= outside.services
    robot = Robot(manifest, components, values, skills, missions.read, missions.unread, topics, services, outside)
    report.extend(findings_about(robot))
    if manifest.missions:
        return replace(robot, components={**components, MISSION: mission_component(robot)})
    return robot


def with_missions(robot: Robot, names: Collection[str]) -> Robot:
    """Return a robot that has no missions but these."""
    missions = {name: mission for name, mission in robot.missions.items() if name in names}
    left = replace(robot, missions=missions, unread=frozenset())
    runs = {MISSION: mission_component(left)} if MISSION in robot.components else {}
    return replace(left, components={**robot.components, **runs})


def written_components(manifest: RobotManifest, report: Report) -> dict[str, RobotComponent]:
    """Return the wired components that the sections request: first those named by users, then those of sections."""
    wires = _Wires(manifest.bus.namespace or "")
    given = _given_topics(manifest.contents)
    for section in sorted(sections_in_use(ROBOT), key=lambda one: not one.names):
        there = reported(report, key_span(manifest.root, (section.name,)))
        with there, section_registry.PLUGINS.guarded(section.name):
            for wanted in section.components(manifest.contents, wires):
                here = reported(report, key_span(manifest.root, wanted.path))
                with here, registry.PLUGINS.guarded(wanted.type_name):
                    if (accepted := _accepted(manifest, wanted, report)) is not None:
                        wires.add(_component(manifest, accepted, given.get(wanted.name, {})))
    return wires.components


def _accepted(manifest: RobotManifest, wanted: WantedComponent, report: Report) -> WantedComponent | None:
    """Return a request with a configuration that its type accepts: what that refuses is reported, and left out.

    None if too little is left.
    """
    if isinstance(wanted.config, Config):
        return wanted
    model, data, is_sound = component_type(wanted.type_name).config_type(), wanted.config, wanted.is_sound
    while True:
        try:
            return replace(wanted, config=model(**data), is_sound=is_sound)
        except ValidationError as error:
            if data is wanted.config:
                report.extend(refusals(model, error, manifest.root, wanted.path, wanted.places))
            refused = {str(details["loc"][0]) for details in error.errors() if details["loc"]}
        if not refused & data.keys():
            return None
        data, is_sound = {name: value for name, value in data.items() if name not in refused}, False


def _given_topics(contents: Contents) -> dict[str, dict[str, str]]:
    """Return the topics that sections give to ports of components: component -> port -> topic."""
    found: dict[str, dict[str, str]] = {}
    for section in sections_in_use(ROBOT):
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
        _, message = min((row[1:] for row in self._written[first:last]), default=(0, ""))
        return message

    def drives(self, topic: str) -> bool:
        """Return whether a base follows the commands on a topic."""
        name = resolve(topic, self.namespace)
        return any(
            end is not None and end.topic == name
            for component in self.components.values()
            for end in (component.end(drives.commands) for drives in component.declared(Drives))
        )


def own_components(manifest: RobotManifest, written: Mapping[str, RobotComponent]) -> dict[str, RobotComponent]:
    """Return the components that every robot runs, except the one that runs missions."""
    always = [section.always for section in sections_in_use(ROBOT) if section.always]
    names = [*written, *(own.type_name for own in always), *([MISSION] if manifest.missions else [])]
    return {own.type_name: _own(manifest, own.type_name, own.config(manifest.contents, names)) for own in always}


def mission_component(robot: Robot) -> RobotComponent:
    """Return the component that runs the missions."""
    manifest, missions = robot.manifest, robot.missions
    programs = {name: mission.program for name, mission in missions.items()}
    published, called = sent_by(programs.values())
    config = {
        "programs": programs,
        "start": manifest.start if manifest.start in missions else None,
        "inputs": {name: dict(mission.inputs) for name, mission in missions.items()},
        "after_crash": {name: manifest.missions[name].after_crash for name in missions},
        "values": robot.values,
        "places": manifest.places,
        "skills": robot.skills,
        "topics": {name: topic for name, topic in robot.topics.items() if name in published},
        "services": {name: service for name, service in robot.services.items() if name in called},
        "settings": {name: types for name, types in robot.settings.items() if f"{name}/change_parameters" in called},
        "triggers": triggers_of(robot),
        "for_others": any(end.type_name == RUN_MISSION for one in robot.components.values() for end in one.ends),
    }
    return _own(manifest, MISSION, config)


def _own(manifest: RobotManifest, type_name: str, config: Mapping[str, object]) -> RobotComponent:
    """Return a component named after its type, placed at the manifest section of that name."""
    return _component(manifest, WantedComponent(type_name, type_name, config, (type_name,)), {})


def _component(manifest: RobotManifest, wanted: WantedComponent, given: Mapping[str, str]) -> RobotComponent:
    """Return the component that was requested; `given` are topics that others assign to its ports."""
    cls, options = component_type(wanted.type_name), wanted.options
    config = wanted.config if isinstance(wanted.config, Config) else cls.config_type()(**wanted.config)
    if defaults := {name: value for name, value in _defaults(manifest.contents) if _lacks(config, name)}:
        config = config.model_copy(update=defaults)
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
    live = (name for name, one in leaves(config) if is_live(one)) if manifest.has_bounds else ()
    bounds = {name: bounds for name in live if (bounds := manifest.bounds_at(made.place(key_of(config, name))))}
    return replace(made, bounds=bounds) if bounds else made


def _defaults(contents: Contents) -> Iterator[tuple[str, object]]:
    for section in sections_in_use(ROBOT):
        yield from section.defaults(contents).items()


def _lacks(config: Config, name: str) -> bool:
    return name in type(config).model_fields and name not in config.model_fields_set


def values_of(manifest: RobotManifest, components: Mapping[str, RobotComponent]) -> dict[str, ValueSource]:
    """Return the values whose source exists."""
    types: dict[str, str] = {}  # by topic
    for end in (end for component in components.values() for end in component.ends if end.type_name):
        types.setdefault(end.topic, end.type_name)
    namespace = manifest.bus.namespace or ""
    levels = {
        f"{section.name}.{name}": status
        for section in sections_in_use(ROBOT)
        for name, status in section.levels(manifest.contents).items()
    }
    entries = {  # not those whose type is a mistake, which is told
        name: entry
        for name, entry in manifest.values.items()
        if entry.type is not None or at(manifest.root, ("values", name, "type")) is None
    }
    found = {name: value_of(entry, components, types, namespace, levels) for name, entry in entries.items()}
    return {name: value for name, value in found.items() if value is not None}
