"""Missions on this robot: their programs and their inputs; all are read before any is checked."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import field

from rbxcompose.composition.robot_file import read_mission
from rbxcompose.composition.robot_manifest import RobotManifest
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report
from rbxcompose.missions.analysis.uses import Using
from rbxcompose.missions.engine.inputs import bind_inputs
from rbxcompose.missions.language.budget import Budget
from rbxcompose.missions.language.reader import read_program
from rbxcompose.model.robot import RobotMission, places_of
from rbxcompose.sections.missions import missions


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
) -> ReadMissions:
    """Read the robot's mission files; one with mistakes is kept as far as it could be read.

    `skills` are the names of all existing skills.
    """
    found: dict[str, RobotMission] = {}
    budget = Budget()
    for name, entry in manifest.missions.items():
        root = read_mission(
            entry.path,
            robot=manifest.name,
            report=report,
            sources=sources,
            sim=manifest.is_simulated,
            environment=environment,
            span=entry.span,
        )
        program = read_program(root, report, skills, budget) if root else None
        if program is not None:
            gone = manifest.history.removed("places")
            given, is_begun = entry.with_.entries, name == manifest.start and entry.is_sound
            places = places_of(manifest)
            inputs, findings = bind_inputs(program, given, places, entry.span, gone, is_begun=is_begun)
            report.extend(findings)
            found[name] = RobotMission(name, program, inputs)
    using = Using({name: one.program for name, one in found.items()})
    report.extend(using.findings)
    written = frozenset(missions.names_in(manifest.root))
    return ReadMissions(found, frozenset((written - found.keys()) | using.broken))
