"""The compiler: the only place that knows the order of the stages. It reads like a table of contents.

Text -> located tree -> typed manifest -> robot -> checks -> plan. Each stage takes the value of the one before it and
adds its findings to the report; nothing here prints, exits or starts anything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rbxcompose.checking import run_checks
from rbxcompose.findings import Report
from rbxcompose.manifest.robot_file import load_robot
from rbxcompose.missions.semantics import check_program
from rbxcompose.model.build import build_robot
from rbxcompose.plan.build import build_plan
from rbxcompose.plan.model import Plan


@dataclass(slots=True)
class Compilation:
    """What came out: a plan unless there are errors, the findings, and the texts that they point into."""

    plan: Plan | None = None
    report: Report = field(default_factory=Report)
    sources: dict[str, str] = field(default_factory=dict)


def compile_robot(
    path: str,
    *,
    profiles: Sequence[str] = (),
    sets: Sequence[str] = (),
    real: bool = False,
    environment: Mapping[str, str],
) -> Compilation:
    """Compile a robot's file (a path, a folder with a `robot.yaml`, or `rbx:...`) and tell all its mistakes."""
    out = Compilation()
    manifest = load_robot(
        path,
        profiles=profiles,
        sets=sets,
        sim=not real,
        environment=environment,
        report=out.report,
        sources=out.sources,
    )
    if manifest is None:
        return out
    robot = build_robot(manifest, environment=environment, report=out.report, sources=out.sources)
    for mission in robot.missions.values():
        out.report.extend(check_program(mission.program, robot.names))
    out.report.extend(run_checks(robot))
    if not out.report.has_errors:
        out.plan = build_plan(robot)
    return out
