"""Reads the file of a test, with a finding for each error."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field, replace
from pathlib import Path, PurePosixPath
from typing import Any

from rbxcompose.compiler import Compilation, compile_robot, robot_for_mission
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Report
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.files import PROFILE, resolve, shown_name
from rbxcompose.manifest.header import ManifestHeader
from rbxcompose.manifest.library import PREFIX
from rbxcompose.manifest.section import TEST
from rbxcompose.manifest.test_file import SECTIONS, TrialFile
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.manifest.validate import MISSING_KEY, WRONG_TYPE, label_of, validate
from rbxcompose.mission_tests import codes
from rbxcompose.mission_tests.event_reader import PUBLISH, read_events
from rbxcompose.mission_tests.expectation_reader import read_expect
from rbxcompose.mission_tests.fault_reader import FAULT
from rbxcompose.mission_tests.mission_facts import MissionFacts
from rbxcompose.mission_tests.mock_reader import read_mocks
from rbxcompose.mission_tests.model import Mock, Trial, TrialEvent
from rbxcompose.mission_tests.sections import TrialContext
from rbxcompose.missions.engine.inputs import bind_inputs
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.program import Program
from rbxcompose.model.robot import Robot
from rbxcompose.plan.model import Plan

ROBOT_FILE = "robot.yaml"


@dataclass(frozen=True, slots=True)
class WrittenTrial:
    """The file of a test before it is interpreted; without `root`, it could not be read."""

    path: Path
    name: str
    root: MappingNode | None
    report: Report


@dataclass(slots=True)
class TrialReader:
    """Reads the tests of one run; each robot is compiled once with each profile, and its findings are reported once.

    `sources` are the texts of all files, `report` has the findings on robots.
    """

    environment: Mapping[str, str]
    sources: dict[str, str] = field(default_factory=dict)
    report: Report = field(default_factory=Report)
    _robots: dict[tuple[str, str], Compilation] = field(default_factory=dict)
    _kept_back: dict[Finding, str] = field(default_factory=dict)  # the finding in a test of a robot with errors

    def read(self, path: Path) -> tuple[Trial | None, Report]:
        """Return the test of a file, None if the test or its robot has errors; and the findings for all its robots."""
        every = self.every(path)
        trials = [self.understand(one) for one in every]
        told = dict.fromkeys(finding for one in every for finding in one.report)
        return trials[0], Report([*told])

    def every(self, path: Path) -> list[WrittenTrial]:
        """Return the contents of a file for each robot with which it runs; the names of further ones are told."""
        first = self.open(path)
        node = first.root.get("also") if first.root is not None else None
        if first.root is None or node is None:
            return [first]
        robots = node.items if isinstance(node, SequenceNode) else ()
        if not robots or not all(isinstance(one, ScalarNode) and one.text for one in robots):
            first.report.add(WRONG_TYPE.at(node.span, "'also' must be a list of robots", label=label_of(node)))
            return [first]
        names = first.root.entries
        own = names["robot"].key if "robot" in names else names["also"].key
        roots = [replace(first.root, entries={**names, "robot": Entry(own, one)}) for one in robots]
        told = [f"{first.name} ({_name_of(one)})" for one in robots if isinstance(one, ScalarNode)]
        return [first, *(WrittenTrial(path, name, root, Report()) for name, root in zip(told, roots, strict=True))]

    def open(self, path: Path) -> WrittenTrial:
        """Return the contents of a file for its first robot; a test without a name gets that of its file."""
        report = Report()
        root = Documents(report, self.sources).read(path, TEST)
        name = root.get("name") if root else None
        return WrittenTrial(path, name.text if isinstance(name, ScalarNode) and name.text else path.name, root, report)

    def understand(self, written: WrittenTrial) -> Trial | None:
        """Return the test that a file contains, None if it cannot run; add its findings to its report."""
        root, report = written.root, written.report
        if root is None:
            return None
        Documents(report, self.sources).check(TrialFile, _without_values(root))
        found = self._robot(root, written.path, report)
        if found is None:
            return None
        trial = _read(root, *found, report)
        return None if report.has_errors or trial is None else replace(trial, name=written.name)

    def summed_up(self, findings: Iterable[Finding]) -> Iterator[Finding]:
        """Yield the findings, but merge those of all tests that the same robot with errors keeps from running."""
        kept_back: dict[str, list[Finding]] = {}
        for one in Report(list(findings)):
            if one in self._kept_back:
                kept_back.setdefault(self._kept_back[one], []).append(one)
            else:
                yield one
        for robot, ones in kept_back.items():
            which = "the test" if len(ones) == 1 else f"{len(ones)} tests"
            yield replace(ones[0], message=_no_robot(robot, which))

    def _robot(self, root: MappingNode, path: Path, report: Report) -> tuple[Robot, Plan] | None:
        """Return the robot and its plan; None if it cannot be found, or has errors outside of its other missions."""
        written = _text(root, "robot", "the robot's file", report)
        if written is None:
            return None
        file = written.text if written.text.startswith(PREFIX) else resolve(written.text, path, written.span)
        if isinstance(file, Finding):
            report.add(file)
            return None
        name = str(file)
        shown = name if isinstance(file, str) else shown_name(file)
        chosen = _text(root, "profile", "the name of a profile", report) if "profile" in root else None
        key = name, chosen.text if chosen is not None else ""
        if key not in self._robots:
            profiles = [chosen.text] if chosen is not None else []
            self._robots[key] = compile_robot(shown, profiles=profiles, environment=self.environment)
            self.report.extend(one for one in self._robots[key].report if not _is_of_profile(one))
            self.sources.update(self._robots[key].sources)
        if chosen is not None and (lost := [one for one in self._robots[key].report if _is_of_profile(one)]):
            help_text = "remove it: the robot has no profiles"
            report.extend(replace(one, span=chosen.span, help=one.help or help_text, fix=None) for one in lost)
            return None
        mission = root.get("mission")
        found = robot_for_mission(self._robots[key], mission.text if isinstance(mission, ScalarNode) else "")
        if found is None:
            why = codes.NEVER.at(written.span, _no_robot(shown, "the test"), help="see the findings of the robot")
            self._kept_back[why] = shown
            report.add(why)
        return found


def _name_of(robot: ScalarNode) -> str:
    """Return what a robot's file is called: its folder, if the file is called as those of all robots are."""
    path = PurePosixPath(robot.text.removeprefix(PREFIX))
    return path.parent.name if path.name == ROBOT_FILE else path.stem


def _is_of_profile(one: Finding) -> bool:
    """Return whether a finding is about the profile that was chosen, and in no file of the robot."""
    return one.span is not None and one.span.file == PROFILE


def _no_robot(robot: str, which: str) -> str:
    return f"the robot '{robot}' has errors, so {which} cannot run"


def _without_values(root: MappingNode) -> MappingNode:
    """Return the header and the names of the sections; their contents are checked where they are read."""
    sections = {name: Entry(entry.key, ScalarNode("", entry.value.span)) for name, entry in root.entries.items()}
    header = {name: entry for name, entry in root.entries.items() if name in ManifestHeader.model_fields}
    return replace(root, entries={**sections, **header})


def _text(root: MappingNode, key: str, what: str, report: Report) -> ScalarNode | None:
    value = root.get(key)
    if value is None:
        report.add(MISSING_KEY.at(root.span, f"a test needs '{key}': {what}"))
    elif isinstance(value, ScalarNode) and value.text:
        return value
    else:
        report.add(WRONG_TYPE.at(value.span, f"'{key}' must be {what}", label=label_of(value)))
    return None


def _read(root: MappingNode, robot: Robot, plan: Plan, report: Report) -> Trial | None:
    chosen = _text(root, "mission", "the name of a mission", report)
    if chosen is None:
        return None
    if chosen.text not in robot.missions:
        message = f"the robot '{robot.manifest.name}' has no mission '{chosen.text}'"
        what = "missions of this robot"
        report.add(codes.UNKNOWN.misspelt(chosen.span, message, chosen.text, robot.missions, what))
        return None
    names, program = robot.names, robot.missions[chosen.text].program
    linked = link(program, names.missions)
    inputs = _inputs(root, robot, chosen, program, report)
    context = TrialContext(robot, linked, names, MissionFacts.of(linked, names), report)
    sections = {key: validate(model, root.entries[key].value, (key,), report) for key, model in _there(root)}
    mocks = read_mocks(context, root.get("mocks"), sections.get("mocks") or {})
    events = read_events(context, root.get("events"), sections.get("events") or ())
    if (model := sections.get("expect")) is None:
        if "expect" not in root or _is_empty(root.entries["expect"].value):
            report.add(MISSING_KEY.at(root.span, "a test needs 'expect': what must have happened"))
        return None
    expect = read_expect(context, root.get("expect"), model)
    _look_at_times(events, expect.until, report)
    is_complete = _is_complete(context.facts, mocks, events)
    if is_complete:
        report.extend(_faults_of_nothing(events))
    header = {key: value.text for key in ("name", "about") if isinstance(value := root.get(key), ScalarNode)}
    return Trial(
        header.get("name", ""),
        header.get("about", ""),
        root.span.file,
        root.entries["name"].value.span if "name" in root else root.span,
        chosen.text,
        program,
        linked,
        names,
        plan,
        inputs,
        mocks,
        events,
        expect,
        is_complete,
    )


def _faults_of_nothing(events: tuple[TrialEvent, ...]) -> Iterator[Finding]:
    """Yield a finding for each fault of a test that needs no robot."""
    for event in events:
        if any(deed.word == FAULT for deed in event.deeds):
            message = "the test answers all that the mission needs, so no servo runs that could have a fault"
            yield codes.NEVER.at(event.span, message, help="leave a skill, a service or a value to the robot")


def _is_complete(facts: MissionFacts, mocks: Mapping[str, Mock], events: tuple[TrialEvent, ...]) -> bool:
    """Return whether the mission needs only what the test provides, and nothing is sent over the bus."""
    deeds = [deed for event in events for deed in event.deeds]
    values = {name for deed in deeds for name in deed.settings} | {name for one in mocks.values() for name in one.sets}
    is_answered = {*facts.skills, *facts.services} <= mocks.keys()
    return is_answered and facts.values <= values and not any(deed.word == PUBLISH for deed in deeds)


def _there(root: MappingNode) -> list[tuple[str, Any]]:
    """Return the sections that are not empty, with their models."""
    return [(key, model) for key, model in SECTIONS.items() if key in root and not _is_empty(root.entries[key].value)]


def _is_empty(node: TreeNode) -> bool:
    return isinstance(node, ScalarNode) and node.plain and not node.text


def _inputs(
    root: MappingNode, robot: Robot, chosen: ScalarNode, program: Program, report: Report
) -> Mapping[str, object]:
    """Return the inputs: those of the test, else the robot's, else the defaults."""
    given = root.get("with")
    entries: dict[str, Entry] = {}
    if isinstance(given, MappingNode):
        entries = given.entries
    elif given is not None and not _is_empty(given):
        report.add(WRONG_TYPE.at(given.span, "'with' must be a map from inputs to values", label=label_of(given)))
    of_robot = robot.manifest.missions[chosen.text].with_.entries
    bound, findings = bind_inputs(program, {**of_robot, **entries}, robot.manifest.places, chosen.span)
    report.extend(findings)
    return bound


def _look_at_times(events: tuple[TrialEvent, ...], until: float | None, report: Report) -> None:
    """Add findings on what can never happen: an event after the end, an order that the robot refuses."""
    is_stopped = is_paused = False
    latest = 0.0
    for event in events:
        if until is not None and event.at > until:
            report.add(codes.NEVER.at(event.span, "this is after the end of the test ('for')"))
        if event.at < latest:
            report.add(codes.NEVER.at(event.span, "this is before the event above it", help="sort events by time"))
        latest = max(latest, event.at)
        for deed in event.deeds:
            refuses = _REFUSED.get(deed.word)
            if refuses and (trouble := refuses(is_stopped, is_paused)):
                report.add(codes.NEVER.at(event.span, trouble))
            is_stopped = {"stop": True, "release": False}.get(deed.word, is_stopped)
            is_paused = {"stop": True, "pause": True, "resume": False}.get(deed.word, is_paused)


def _no_resume(is_stopped: bool, is_paused: bool) -> str:
    if is_stopped:
        return "a robot that is stopped does not resume: 'release' it first"
    return "" if is_paused else "the mission is not paused here, so it cannot be resumed"


_REFUSED: Mapping[str, Callable[[bool, bool], str]] = {
    "resume": _no_resume,
    "pause": lambda stopped, paused: "the mission is already paused here" if paused else "",
    "release": lambda stopped, paused: "" if stopped else "the robot is not stopped here",
}
