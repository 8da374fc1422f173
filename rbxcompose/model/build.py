"""From the manifest to the robot: sections become parts, ports become ends of wires, actions become skills.

What does not fit together is left out here; the checks say it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rbxcompose.composition.robot_manifest import RobotManifest
from rbxcompose.config import Config
from rbxcompose.findings import Report
from rbxcompose.levels import LOG_LEVELS
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import ROBOT, Contents
from rbxcompose.manifest.wanted_components import WantedComponent
from rbxcompose.missions.analysis.effects import sent_by
from rbxcompose.missions.program.sources import ValueSource
from rbxcompose.model.missions import read_missions
from rbxcompose.model.robot import Part, Robot
from rbxcompose.model.skills import names_of_skills, services_of, skills_of, topics_of
from rbxcompose.model.values import value_of
from rbxcompose.model.wires import ends_of, readers, resolve
from rbxcompose.sdk.capabilities import require_declared
from rbxcompose.sdk.ports import Out
from rbxcompose.sdk.registry import component_type

MISSION = "mission"
ALWAYS = ("transforms", "diagnostics")  # what every robot runs


def build_robot(
    manifest: RobotManifest, *, environment: Mapping[str, str], report: Report, sources: dict[str, str]
) -> Robot:
    """Return the whole robot; what is wrong with its mission files goes into `report`."""
    written = written_parts(manifest)
    parts = {**written, **own_parts(manifest, written)}
    values, topics, services = values_of(manifest, parts), topics_of(manifest, parts), services_of(manifest, parts)
    missions = read_missions(manifest, environment, report, sources, names_of_skills(parts))
    skills = skills_of(parts, [one.program for one in missions.read.values()])
    robot = Robot(manifest, parts, values, skills, missions.read, missions.unread, topics, services)
    if manifest.missions:
        parts[MISSION] = mission_part(robot)
    return robot


def written_parts(manifest: RobotManifest) -> dict[str, Part]:
    """Return the parts that the sections ask for, wired: first those that users name, then what sections bring."""
    wires = _Wires(manifest.bus.namespace or "")
    given = _given_topics(manifest.contents)
    for section in sorted(sections(ROBOT), key=lambda one: not one.names):
        for wanted in section.components(manifest.contents, wires):
            wires.parts[wanted.name] = _part(manifest, wanted, given.get(wanted.name, {}))
    return wires.parts


def _given_topics(contents: Contents) -> dict[str, dict[str, str]]:
    """Return the topics that sections give to ports of components: component -> port -> topic."""
    found: dict[str, dict[str, str]] = {}
    for section in sections(ROBOT):
        for component, topics in section.connects(contents).items():
            found.setdefault(component, {}).update(topics)
    return found


@dataclass(frozen=True, slots=True)
class _Wires:
    """The wires of the parts that there are so far."""

    namespace: str
    parts: dict[str, Part] = field(default_factory=dict)

    def message_of(self, topic: str) -> str:
        """Return the type of who listens to a topic, else of who publishes below it; empty if nobody does."""
        name = resolve(topic, self.namespace)
        ends = [end for part in self.parts.values() for end in part.ends]
        sources = [end for end in ends if isinstance(end.port, Out) and end.topic.startswith(f"{name}/")]
        return next((end.type_name for end in [*readers(ends, name), *sources]), "")


def own_parts(manifest: RobotManifest, written: Mapping[str, Part]) -> dict[str, Part]:
    """Return the parts that every robot runs, but for the one that runs missions."""
    names = [*written, *ALWAYS, *([MISSION] if manifest.missions else [])]
    analyzers = {name: one.model_dump(exclude_none=True) for name, one in manifest.diagnostics.analyzers.items()}
    return {
        "transforms": _own(manifest, "transforms", {}),
        "diagnostics": _own(manifest, "diagnostics", {"analyzers": analyzers, "expected": names}),
    }


def mission_part(robot: Robot) -> Part:
    """Return the part that runs the missions."""
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
    }
    return _own(manifest, MISSION, config)


def _own(manifest: RobotManifest, type_name: str, config: Mapping[str, object]) -> Part:
    """Return a part that is named like its type and stands where the manifest has the section of that name."""
    return _part(manifest, WantedComponent(type_name, type_name, config, (type_name,)), {})


def _part(manifest: RobotManifest, wanted: WantedComponent, given: Mapping[str, str]) -> Part:
    """Return a component that is wanted as a part; `given` are topics of its ports that others give."""
    cls, options = component_type(wanted.type_name), wanted.options
    config = wanted.config if isinstance(wanted.config, Config) else cls.config_type()(**wanted.config)
    ends = ends_of(wanted.name, cls, config, manifest.bus.namespace or "", {**options.connect, **given})
    process, log = options.process or cls.process, LOG_LEVELS[options.log]
    names = (end.name for end in ends)
    capabilities = require_declared(wanted.type_name, cls.capabilities(config), names, type(config))
    return Part(
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
    )


def values_of(manifest: RobotManifest, parts: Mapping[str, Part]) -> dict[str, ValueSource]:
    """Return the values whose source is there."""
    ends = [end for part in parts.values() for end in part.ends]
    namespace, groups = manifest.bus.namespace or "", tuple(manifest.diagnostics.analyzers)
    found = {name: value_of(entry, parts, ends, namespace, groups) for name, entry in manifest.values.items()}
    return {name: value for name, value in found.items() if value is not None}
