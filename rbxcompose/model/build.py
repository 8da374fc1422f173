"""From the manifest to the robot: sections become parts, ports become ends of wires, actions become skills.

What does not fit together is left out here; the checks say it.
"""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.config import Config
from rbxcompose.findings import Report
from rbxcompose.manifest.models import ComponentEntry, ComponentOptions, RobotManifest
from rbxcompose.missions.goals import skill_of
from rbxcompose.missions.sources import SkillSource, ValueSource
from rbxcompose.model.missions import read_missions
from rbxcompose.model.robot import Part, Robot, RobotMission
from rbxcompose.model.values import value_of
from rbxcompose.model.wiring import End, ends_of, readers, resolve
from rbxcompose.sdk.ports import Out, ServesAction
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
    values, skills = values_of(manifest, parts), skills_of(parts)
    missions = read_missions(manifest, environment, report, sources)
    if manifest.missions:
        parts[MISSION] = mission_part(manifest, missions, values, skills)
    return Robot(manifest, parts, values, skills, missions)


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
    """Return the parts that every robot runs beside those that its user wrote, but for the one that runs missions."""
    names = [*written, *ALWAYS, *([MISSION] if manifest.missions else [])]
    analyzers = {name: one.model_dump(exclude_none=True) for name, one in manifest.diagnostics.analyzers.items()}
    return {
        "transforms": _own(manifest, "transforms", {}),
        "diagnostics": _own(manifest, "diagnostics", {"analyzers": analyzers, "expected": names}),
    }


def mission_part(
    manifest: RobotManifest,
    missions: Mapping[str, RobotMission],
    values: Mapping[str, ValueSource],
    skills: Mapping[str, SkillSource],
) -> Part:
    """Return the part that runs the missions."""
    config = {
        "programs": {name: mission.program for name, mission in missions.items()},
        "start": manifest.start if manifest.start in missions else None,
        "inputs": {name: dict(mission.inputs) for name, mission in missions.items()},
        "values": values,
        "places": manifest.places,
        "skills": skills,
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
    return Part(name, type_name, cls, config, process, options.starts_after, ends, path, options.restart)


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
        "inputs": {key: {"priority": one.priority, "timeout": one.timeout} for key, one in entry.inputs.items()},
        "locks": {key: {"priority": one.priority, "timeout": one.timeout} for key, one in entry.locks.items()},
    }
    return _part(manifest, name, MUX, component_type(MUX).config_type()(**config), {}, ("muxes", name))


def _message(mux: str, ends: list[End], namespace: str) -> str:
    """Return the type that a mux forwards: that of who listens to it, else of its sources, else a twist."""
    topic = resolve(mux, namespace)
    heard = readers(ends, topic)
    sources = [end for end in ends if isinstance(end.port, Out) and end.topic.startswith(f"{topic}/")]
    return next((end.type_name for end in [*heard, *sources]), "geometry_msgs/msg/Twist")


def skills_of(parts: Mapping[str, Part]) -> dict[str, SkillSource]:
    """Return the skills that the parts offer: each action is one, named like its topic."""
    found: dict[str, SkillSource] = {}
    for part in parts.values():
        for end in part.ends:
            if isinstance(end.port, ServesAction) and end.port.interface is not None:
                name = end.topic.rsplit("/", 1)[-1]
                skill = skill_of(end.port.interface, name, end.port.claims, end.port.restartable)
                found.setdefault(name, SkillSource(skill, end.type_name, end.topic))
    return found


def values_of(manifest: RobotManifest, parts: Mapping[str, Part]) -> dict[str, ValueSource]:
    """Return the values whose source is there."""
    ends = [end for part in parts.values() for end in part.ends]
    namespace = manifest.bus.namespace or ""
    found = {name: value_of(entry, parts, ends, namespace) for name, entry in manifest.values.items()}
    return {name: value for name, value in found.items() if value is not None}
