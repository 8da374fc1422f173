"""From the manifest to the robot: sections become parts, ports become ends of wires, actions become skills.

What does not fit together is left out here; the checks say it.
"""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.config import Config
from rbxcompose.diagnostics.levels import LOG_LEVELS
from rbxcompose.findings import Report
from rbxcompose.manifest.models import DESCRIPTION, ComponentEntry, ComponentOptions, RobotManifest
from rbxcompose.missions.deeds import sent_by
from rbxcompose.missions.sources import ValueSource
from rbxcompose.model.missions import read_missions
from rbxcompose.model.robot import Part, Robot
from rbxcompose.model.skills import names_of_skills, services_of, skills_of, topics_of
from rbxcompose.model.values import value_of
from rbxcompose.model.wiring import End, ends_of, readers, resolve
from rbxcompose.sdk.capabilities import require_declared
from rbxcompose.sdk.ports import Out
from rbxcompose.sdk.registry import component_type

MUX = "mux"
MISSION = "mission"
NO_OPTIONS = ComponentOptions()
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
    """Return the parts that `components:` and `muxes:` ask for, wired."""
    remaps = _mux_sources(manifest)
    parts: dict[str, Part] = {}
    for name, entry in manifest.components.items():
        if entry.config is not None:
            connect = {**entry.options.connect, **remaps.get(name, {})}
            parts[name] = _part(manifest, name, entry.type, entry.config, connect, ("components", name), entry.options)
    for name in manifest.muxes:
        parts[name] = _mux(manifest, name, parts)
    return parts


def own_parts(manifest: RobotManifest, written: Mapping[str, Part]) -> dict[str, Part]:
    """Return the parts that robots run beside those that their user wrote, but for the one that runs missions."""
    description = _description(manifest)
    names = [*written, *ALWAYS, *description, *([MISSION] if manifest.missions else [])]
    analyzers = {name: one.model_dump(exclude_none=True) for name, one in manifest.diagnostics.analyzers.items()}
    return {
        "transforms": _own(manifest, "transforms", {}),
        "diagnostics": _own(manifest, "diagnostics", {"analyzers": analyzers, "expected": names}),
        **description,
    }


def _description(manifest: RobotManifest) -> dict[str, Part]:
    """Return the part that publishes what the body is, if there is one."""
    if manifest.body is None:
        return {}
    config = component_type(DESCRIPTION).config_type()(**{"urdf": manifest.body.text})
    return {DESCRIPTION: _part(manifest, DESCRIPTION, DESCRIPTION, config, {}, ("body", "urdf"))}


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
    return _part(manifest, type_name, type_name, component_type(type_name).config_type()(**config), {}, (type_name,))


def _part(
    manifest: RobotManifest,
    name: str,
    type_name: str,
    config: Config,
    connect: Mapping[str, str],
    path: tuple[str, ...],
    options: ComponentOptions = NO_OPTIONS,
) -> Part:
    cls = component_type(type_name)
    ends = ends_of(name, cls, config, manifest.bus.namespace or "", connect)
    process = options.process or cls.process
    log = LOG_LEVELS[options.log]
    capabilities = require_declared(type_name, cls.capabilities(config), (end.name for end in ends), type(config))
    after, restart = options.starts_after, options.restart
    return Part(name, type_name, cls, config, process, after, ends, path, restart, log, capabilities)


def _mux_sources(manifest: RobotManifest) -> dict[str, dict[str, str]]:
    """Return the topics that muxes give to the outputs they take: component -> port -> topic."""
    remaps: dict[str, dict[str, str]] = {}
    for mux, entry in manifest.muxes.items():
        for name, source in entry.inputs.items():
            component, _, port = (source.source or "").partition(".")
            written = manifest.components.get(component)
            if written is not None and written.config is not None:
                for output in _outputs(written, written.config, mux, port):
                    remaps.setdefault(component, {})[output] = f"{mux}/{name}"
    return remaps


def _outputs(entry: ComponentEntry, config: Config, topic: str, port: str) -> list[str]:
    """Return the output that a mux takes: the one that is named, else the one on the mux's topic, else the only one."""
    ports = component_type(entry.type).ports(config)
    outputs = {name: end.topic for name, end in ports.items() if isinstance(end, Out)}
    if port:
        return [port] if port in outputs else []
    on_topic = [name for name, own in outputs.items() if topic in (own, entry.options.connect.get(name))]
    return on_topic or (list(outputs) if len(outputs) == 1 else [])


def _mux(manifest: RobotManifest, name: str, parts: Mapping[str, Part]) -> Part:
    entry = manifest.muxes[name]
    ends = [end for part in parts.values() for end in part.ends]
    config: dict[str, object] = {
        "output": name,
        "message": _message(name, ends, manifest.bus.namespace or ""),
        "inputs": {key: one.model_dump(exclude={"source"}, exclude_unset=True) for key, one in entry.inputs.items()},
        "locks": {key: {"priority": one.priority, "timeout": one.timeout} for key, one in entry.locks.items()},
    }
    return _part(manifest, name, MUX, component_type(MUX).config_type()(**config), {}, ("muxes", name))


def _message(mux: str, ends: list[End], namespace: str) -> str:
    """Return the type that a mux forwards: that of who listens to it, else of its sources, else a twist."""
    topic = resolve(mux, namespace)
    heard = readers(ends, topic)
    sources = [end for end in ends if isinstance(end.port, Out) and end.topic.startswith(f"{topic}/")]
    return next((end.type_name for end in [*heard, *sources]), "geometry_msgs/msg/Twist")


def values_of(manifest: RobotManifest, parts: Mapping[str, Part]) -> dict[str, ValueSource]:
    """Return the values whose source is there."""
    ends = [end for part in parts.values() for end in part.ends]
    namespace, groups = manifest.bus.namespace or "", tuple(manifest.diagnostics.analyzers)
    found = {name: value_of(entry, parts, ends, namespace, groups) for name, entry in manifest.values.items()}
    return {name: value for name, value in found.items() if value is not None}
