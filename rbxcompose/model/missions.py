"""Missions on this robot: their programs and their inputs."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.findings import Report
from rbxcompose.manifest.models import RobotManifest
from rbxcompose.manifest.robot_file import read_mission
from rbxcompose.missions.inputs import bind_inputs
from rbxcompose.missions.reading import read_program
from rbxcompose.model.robot import RobotMission


def read_missions(
    manifest: RobotManifest, environment: Mapping[str, str], report: Report, sources: dict[str, str]
) -> dict[str, RobotMission]:
    """Read the robot's mission files; one with mistakes is kept as far as it could be read."""
    found: dict[str, RobotMission] = {}
    for name, entry in manifest.missions.items():
        root = read_mission(
            entry.path,
            robot=manifest.name,
            report=report,
            sources=sources,
            sim=manifest.is_simulated,
            environment=environment,
        )
        program = read_program(root, report) if root else None
        if program is not None:
            inputs, findings = bind_inputs(program, entry.with_.entries, manifest.places, entry.span)
            report.extend(findings)
            found[name] = RobotMission(name, program, inputs)
    return found
