"""The compiler: the only place that knows the order of the stages. It reads like a table of contents."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import (
    Finding,
    NeededFile,
    Related,
    Report,
    Rule,
    Severity,
    Span,
    kind,
    needed,
    one_compile,
)
from rbxcompose.base.garbage_collection import paused_collection
from rbxcompose.compiler.check_runner import findings_of, run_checks
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_file import load_robot
from rbxcompose.compiler.doubts import with_removals
from rbxcompose.compiler.model.build import build_robot, read_missions, with_missions
from rbxcompose.compiler.model.flow import start_order
from rbxcompose.compiler.model.robot import NOTHING, Outside, Robot, RobotComponent
from rbxcompose.compiler.model.skills import names_of_skills, skills_of
from rbxcompose.compiler.plan.model import BusPlan, Instance, Plan, Wire
from rbxcompose.manifest.files import PROFILE
from rbxcompose.manifest.reader import ParsedText, Texts
from rbxcompose.manifest.tree import LEAST_STEPS, PROFILE_STEPS, STEP_BYTES, STEP_VALUES
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.msgs import registry
from rbxcompose.sdk.capabilities import RunsMissions

NOT_TRIED = kind("RBX7003", Severity.WARNING)


@dataclass(slots=True)
class Compilation:
    """The result: a plan unless there are errors, the findings, and the texts that they point into.

    The robot is as complete as its files could be read.
    """

    robot: Robot | None = None
    plan: Plan | None = None
    report: Report = field(default_factory=Report)
    sources: dict[str, str] = field(default_factory=dict)
    needed: frozenset[NeededFile] = frozenset()  # beside these texts


@one_compile()
@paused_collection()
def compile_robot(
    path: str,
    *,
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    sets: Sequence[str] = (),
    real: bool = False,
    environment: Mapping[str, str],
    unsaved: Mapping[Path, str] = MappingProxyType({}),
    outside: Outside = NOTHING,
    tries_profiles: bool = False,
) -> Compilation:
    """Compile a robot's file (a path, a folder with a `robot.yaml`, or `rbx:...`) and report all its mistakes.

    `overlays` are files that change it. `unsaved` are texts from an editor, by the real path of the file that each
    replaces. `outside` is what it has of other robots. With `tries_profiles`, each profile is tried as well if
    none was chosen, so that a broken one is found before it is used.
    """

    parsed: dict[tuple[str, str], ParsedText] = {}  # a profile changes no text

    def compiled(chosen: Sequence[str], own: Set[str] = frozenset()) -> Compilation:
        out = Compilation(sources=Texts(unsaved, parsed))
        manifest = load_robot(
            path,
            profiles=chosen,
            overlays=overlays,
            sets=[one for one in sets if one.partition("=")[0] not in own],
            sim=not real,
            environment=environment,
            report=out.report,
            sources=out.sources,
        )
        if manifest is None:
            return out
        out.robot = build_robot(
            manifest, environment=environment, report=out.report, sources=out.sources, outside=outside
        )
        run_checks(out.robot, out.report)
        out.report.findings = manifest.inclusions.located(out.report.findings)
        return out

    out = compiled(profiles)
    if out.robot is not None and not profiles and tries_profiles:
        steps = sum(len(mission.program.nodes) for mission in out.robot.missions.values())
        steps = max(LEAST_STEPS, steps + _steps_to_read(out.sources))
        keys = out.robot.manifest.profile_keys  # a profile is tried with its own value of what `--set` replaces
        for number, (name, span) in enumerate(out.robot.manifest.profiles.items(), 1):
            if number * steps > PROFILE_STEPS:
                message = f"the profiles from '{name}' on were not tried: it would take too long for this robot"
                out.report.add(NOT_TRIED.at(span, message, help=f"rbxcompose check --profile {name}"))
                break
            _report_profile(
                span, compiled([name], keys.get(name, frozenset())), out, {SET, *out.robot.manifest.overlays}
            )
    if out.robot is not None:
        registry.choose(out.robot.manifest.messages)  # profiles may have had others
    if out.robot is not None and not out.report.has_errors:
        out.plan = build_plan(out.robot)
    out.needed = needed()
    return out


def robot_for_mission(out: Compilation, name: str) -> tuple[Robot, Plan] | None:
    """Return a robot and its plan for one mission; None if anything but its other missions has errors."""
    if out.robot is None or out.plan is not None:
        return (out.robot, out.plan) if out.robot is not None and out.plan is not None else None
    robot, wanted = out.robot, _with_used(out.robot, name)
    files = {name: entry.path for name, entry in robot.manifest.missions.items()}
    others = {*files.values()} - {files[name] for name in wanted & files.keys()}
    errors = [finding.span for finding in out.report if finding.severity is Severity.ERROR]
    is_elsewhere = all(span is not None and Path(span.file).resolve() in others for span in errors)
    if not is_elsewhere or not wanted <= robot.missions.keys():
        return None
    left = with_missions(robot, wanted)
    return left, build_plan(left)


@one_compile()
@paused_collection()
def look_at_mission(
    robot: Robot, name: str, environment: Mapping[str, str], unsaved: Mapping[Path, str]
) -> tuple[Report, Mapping[str, str]]:
    """Return what is wrong with the newest text of one mission, and the texts that the findings point into.

    The robot was compiled before. Its own rules are left out: only `compile_robot` sees what a mission does to it.
    """
    changed, report, sources = with_text_of_mission(robot, name, environment, unsaved)
    if changed is not None:
        program = changed.missions[name].program

        def find(rule: Rule[Any], subject: Robot | Examined) -> list[Finding]:
            return findings_of(rule, subject) if getattr(subject, "program", None) is program else []

        run_checks(changed, report, find)
    return report, sources


def with_text_of_mission(
    robot: Robot, name: str, environment: Mapping[str, str], unsaved: Mapping[Path, str]
) -> tuple[Robot | None, Report, Mapping[str, str]]:
    """Return a robot with the newest text of one mission, None if it cannot be read; what is wrong; and the texts."""
    report, sources = Report(), Texts(unsaved)
    skills = names_of_skills(robot.components, robot.outside)
    read = read_missions(robot.manifest, environment, report, sources, skills, only=name).read
    if (mission := read.get(name)) is None:
        return None, report, sources
    missions = {**robot.missions, name: mission}
    known = skills_of(robot.components, [one.program for one in missions.values()], robot.outside)
    return replace(robot, missions=missions, skills=known), report, sources


def _with_used(robot: Robot, name: str) -> set[str]:
    """Return a mission and those that it uses."""
    found, waiting = set[str](), [name]
    while waiting:
        found.add(text := waiting.pop())
        nodes = robot.missions[text].program.nodes if text in robot.missions else ()
        waiting += [node.step.uses.text for node in nodes if node.step.uses and node.step.uses.text not in found]
    return found


def _steps_to_read(sources: Mapping[str, str]) -> int:
    """Return how many steps of missions take as long as reading the files of a robot once more."""
    values = sources.total_values if isinstance(sources, Texts) else 0
    return max(sum(map(len, sources.values())) // STEP_BYTES, values // STEP_VALUES)


def _report_profile(profile: Span, tried: Compilation, out: Compilation, above: Set[str]) -> None:
    """Add the findings that only a profile causes, in its own text or in the robot's files.

    `above` names the layers that override profiles: their values were chosen without this profile.
    """
    known = {(finding.code, finding.span) for finding in out.report}
    new = [one for one in tried.report if (one.code, one.span) not in known]
    if out.robot and tried.robot:
        ends = ((name, end.instance) for end in out.robot.ends for name in (end.skill, end.topic) if name)
        new = list(with_removals(new, tried.robot.manifest.history, profile, ends))
    more = tried.sources.keys() - out.sources.keys() - {PROFILE, SET}  # a mission that only this profile has
    out.sources.update({file: tried.sources[file] for file in sorted(more)})
    for finding in new:
        span = finding.span
        if span is None or span.file not in out.sources or span.file in above:
            continue
        inside = next((one for one in finding.related if profile.contains(one.span)), None)
        if profile.contains(span):
            out.report.add(finding)
        elif inside is not None:
            fine = [] if span.file in more else [Related(span, "without the profile, this is fine")]
            others = [*fine, *finding.related]
            related = tuple(other for other in others if other is not inside)
            out.report.add(replace(finding, span=inside.span, label="", related=related, fix=None))
        else:
            related = (*finding.related, Related(profile, "with this profile"))
            out.report.add(replace(finding, related=related, fix=None))


def build_plan(robot: Robot) -> Plan:
    """Return the plan for `up`; the robot must have no errors."""
    manifest = robot.manifest
    missions = (component.name for component, _ in robot.declared(RunsMissions))
    last = [name for name in missions if name not in robot.written]  # starts when everything else is active
    order = start_order(
        {name: component.starts_after for name, component in robot.components.items() if name not in last}
    )
    bus = manifest.bus
    return Plan(
        robot=manifest.name,
        file=str(manifest.path),
        instances=tuple(_instance(robot.components[name]) for name in (*order, *last)),
        bus=BusPlan(bus.domain, bus.namespace or "", bus.port, bus.wire, bus.router, bus.clock, bus.access, bus.links),
        start=manifest.start,
        is_simulated=manifest.is_simulated,
        messages=dict(manifest.messages),
    )


def _instance(component: RobotComponent) -> Instance:
    wires = tuple(Wire(end.name, end.port.kind, end.topic, end.type_name) for end in component.ends)
    after, restart = component.starts_after, component.restart
    return Instance(
        component.name,
        component.type_name,
        component.config,
        component.process,
        after,
        wires,
        restart,
        component.log,
        component.bounds,
    )
