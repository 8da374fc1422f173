"""Reads the file of a test, with a finding for each error."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path, PurePosixPath
from typing import Any

from rbxcompose.base.config import Time
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Finding, Related, Report, Span, one_compile
from rbxcompose.compiler.check_runner import run_checks
from rbxcompose.compiler.compile import Compilation, compile_robot, robot_for_mission
from rbxcompose.compiler.model.robot import Robot, RobotMission, resolve
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.servos.sections.faults import buses_of_joints
from rbxcompose.domains.servos.twins.servo_faults import FAULTS, UNPLUG, InjectFault
from rbxcompose.manifest import test_file as trials
from rbxcompose.manifest.documents import Documents, ManifestHeader
from rbxcompose.manifest.files import PREFIX, PROFILE, shown_name
from rbxcompose.manifest.files import resolve as resolve_file
from rbxcompose.manifest.reader import Texts
from rbxcompose.manifest.section import TEST
from rbxcompose.manifest.test_file import SECTIONS, STEP_KEYS, TrialFile
from rbxcompose.manifest.tree import (
    Entry,
    KeyPath,
    MappingNode,
    NodePlaces,
    ScalarNode,
    SequenceNode,
    TreeNode,
    at,
    entries_of,
    key_span,
    text_at,
    value_span,
)
from rbxcompose.manifest.validate import MISSING_KEY, WRONG_TYPE, label_of, to_plain, validate
from rbxcompose.missions.engine.inputs import bind_inputs
from rbxcompose.missions.language.literals import brief, literal
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.program import Program, RobotNames, Skill
from rbxcompose.msgs import registry
from rbxcompose.msgs.plain import from_plain
from rbxcompose.sdk.registry import skill_names
from rbxcompose.tools.mission_tests import codes
from rbxcompose.tools.mission_tests.judge import ON_TIME
from rbxcompose.tools.mission_tests.model import (
    FAILS,
    HALTED,
    RUNS,
    SKIPPED,
    SUCCEEDS,
    EventDeed,
    Expectations,
    ExpectedMessage,
    ExpectedStep,
    ExpectedValue,
    MissionFacts,
    Mock,
    Trial,
    TrialEvent,
    ValueSetting,
)
from rbxcompose.tools.mission_tests.scope import agrees, check_setting, names_of, read_value, setting_of

_REMOVE = "remove one of them"
FAULT = "fault"
STEP_HELP = "write the name of a skill, a node or a state, such as '- go_to: corner_1'"
ENDS = {one: one for one in (SUCCEEDS, FAILS, HALTED, SKIPPED)}
AT, SET, PUBLISH = "at", "set", "publish"
ROBOT_FILE = "robot.yaml"


@dataclass(frozen=True, slots=True)
class TrialContext:
    """The robot and the mission of a test, what is known about them, and the report for findings."""

    robot: Robot
    program: Program
    names: RobotNames
    facts: MissionFacts
    report: Report

    def knows(self, place: Span, name: str, known: Iterable[str], message: str, what: str) -> bool:
        """Return whether a name is a known one; if not, report the `message`, with the nearest of `what` there are."""
        if name in known:
            return True
        self.report.add(codes.UNKNOWN.misspelt(place, message, name, known, what))
        return False

    def knows_step(self, key: ScalarNode) -> bool:
        """Return whether the mission has a step of this name, and report it if it has none."""
        message = f"the mission '{self.program.name}' has no step '{key.text}'"
        return self.knows(key.span, key.text, self.facts.steps, message, "its steps")

    def value(self, node: TreeNode, wanted: Type, what: str) -> Value:
        """Return an expected value, and report what is wrong with it."""
        value, findings = read_value(node, wanted, self.names, what)
        self.report.extend(findings)
        return value

    def settings(self, node: TreeNode | None, known: Mapping[str, Type]) -> dict[str, ValueSetting]:
        """Return the settings by name; besides the robot's values, expressions see what is `known`."""
        found: dict[str, ValueSetting] = {}
        valid = names_of(self.names)
        for name, entry in entries_of(node).items():
            message = f"the robot has no value '{name}'"
            if not self.knows(entry.key.span, name, valid, message, "values of this robot"):
                continue
            inputs = {key: input_.type for key, input_ in self.program.inputs.items()}
            findings = list(check_setting(entry.value, valid[name], self.program, self.names, {**inputs, **known}))
            self.report.extend(findings)
            if not findings:
                found[name] = setting_of(entry.value, valid[name], self.names)
        return found

    def type_of_datum(self, name: str) -> Type | None:
        """Return the type of a datum of the mission, None if it does not exist."""
        if name in self.program.data:
            return self.program.data[name].type
        return UNKNOWN if name in self.program.saved else None


def contradictions(expect: Expectations) -> Iterator[Finding]:
    """Yield what contradicts something else that is expected."""
    for count in expect.count:
        barred = (step for step in expect.never if _bars_all(step) and step.name == count.name and count.value)
        other = next(barred, None)
        if other is not None:
            message = f"'{count.name}' can begin never, or as often as 'count' says, but not both"
            related = [Related(count.span, "it is to begin here")]
            yield codes.NEVER.at(other.span, message, help=_REMOVE, related=related)
    for step in expect.steps:
        other = next((never for never in expect.never if _bars(never, step)), None)
        if other is not None:
            message = f"'{other.text}' must never be, but it is one of the expected 'steps'"
            related = [Related(step.span, "it is expected here")]
            yield codes.NEVER.at(other.span, message, help=_REMOVE, related=related)
    yield from _too_many(expect)
    yield from _turned_round(expect)


def _too_many(expect: Expectations) -> Iterator[Finding]:
    """Yield the counts of steps that are listed more often."""
    listed = Counter(step.name for step in expect.steps)
    for count in expect.count:
        if isinstance(count.value, int) and count.value < listed[count.name]:
            times = "once" if listed[count.name] == 1 else f"{listed[count.name]} times"
            last = [step for step in expect.steps if step.name == count.name][-1]
            message = f"'{count.name}' is to begin fewer times than 'steps' has it: that is {times}"
            related = [Related(last.span, "the last of them")]
            yield codes.NEVER.at(count.span, message, help="change the count, or the steps", related=related)


def _turned_round(expect: Expectations) -> Iterator[Finding]:
    """Yield the steps that are to begin before those above them, because they are searched in their order."""
    latest: ExpectedStep | None = None
    for step in expect.steps:
        if step.at is None:
            continue
        if latest is not None and latest.at is not None and step.at < latest.at - 2 * ON_TIME:
            message, related = (
                "steps are listed as they begin, and this is earlier",
                [Related(latest.span, "this one is later")],
            )
            yield codes.NEVER.at(step.span, message, help="exchange them", related=related)
        else:
            latest = step


def _bars_all(step: ExpectedStep) -> bool:
    return not step.arguments and not step.ended and step.at is None


def _bars(never: ExpectedStep, step: ExpectedStep) -> bool:
    """Return whether every step that is as expected is one that must never be."""
    if never.name != step.name or never.at not in (None, step.at):
        return False
    if never.ended and (not step.ended or never.ended not in (step.ended, never.counts_as.get(step.ended))):
        return False
    arguments = step.arguments
    return all(name in arguments and agrees(value, arguments[name]) for name, value in never.arguments.items())


def read_mocks(context: TrialContext, node: TreeNode | None, models: Mapping[str, trials.MockModel]) -> dict[str, Mock]:
    """Return the mocks by the name of the skill or service that they replace."""
    return {
        name: _mock(context, name, entry, models[name]) for name, entry in entries_of(node).items() if name in models
    }


def _mock(context: TrialContext, name: str, entry: Entry, model: trials.MockModel) -> Mock:
    names, value = context.names, entry.value
    message, there = f"the robot has no skill or service '{name}'", {*names.skills, *skill_names(), *names.services}
    is_there = context.knows(entry.key.span, name, there, message, "skills of this robot")
    if is_there and name not in context.facts.skills and name not in context.facts.services:
        message = f"the mission '{context.program.name}' does not use '{name}'"
        context.report.add(codes.UNUSED_MOCK.at(entry.key.span, message))
    skill = names.skills.get(name, Skill(name))
    outcomes = {SUCCEEDS: SUCCEEDS, FAILS: FAILS, **skill.outcomes}
    written: dict[KeyPath, str] = {("result",): model.result}
    written |= {("outcome_at", call): outcome for call, outcome in model.outcome_at.items()}
    for path, outcome in written.items():
        context.knows(value_span(value, path), outcome, outcomes, f"there is no outcome '{outcome}'", "outcomes")
    return Mock(
        name,
        entry.key.span,
        model.takes,
        model.result,
        model.message,
        context.settings(at(value, ("sets",)), skill.arguments),
        frozenset(model.fails_at),
        tuple(_values(context, skill, at(value, ("fails_for",)))),
        {int(call): outcome for call, outcome in model.outcome_at.items()},
        skill.main,
        outcomes,
    )


def _values(context: TrialContext, skill: Skill, node: TreeNode | None) -> list[Value]:
    """Return the values of the main argument for which calls fail."""
    if not isinstance(node, SequenceNode):
        return []
    if not skill.main:
        what = "single value" if skill.arguments else "argument"
        context.report.add(codes.NEVER.at(node.span, f"'{skill.name}' takes no {what}"))
        return []
    wanted = skill.arguments.get(skill.main, UNKNOWN)
    return [context.value(item, wanted, f"the argument '{skill.main}'") for item in node.items]


def read_fault(context: TrialContext, node: TreeNode, model: trials.InjectedModel) -> EventDeed | None:
    """Return the fault as a request to the driver of a bus, None after a finding."""
    driven, report = buses_of_joints(context.robot.manifest.contents), context.report
    words, span = (*FAULTS, UNPLUG), value_span(node, (FAULT, FAULT))
    if not context.knows(span, model.fault, words, f"no fault is called '{model.fault}'", "faults"):
        return None
    if (model.joint is None) == (model.bus is None):
        report.add(codes.NEVER.at(key_span(node, (FAULT,)), "a fault is of one joint, or of one bus"))
        return None
    if model.joint is not None and model.fault == UNPLUG:
        report.add(codes.NEVER.at(span, f"'{model.joint}' cannot be unplugged", help="give 'bus' instead of 'joint'"))
        return None
    joint, bus = model.joint or "", model.bus or ""
    if model.bus is None:
        place, message = value_span(node, (FAULT, "joint")), f"no servo drives '{joint}'"
        is_known = context.knows(place, joint, driven, message, "joints with a servo")
    else:
        place, message = value_span(node, (FAULT, "bus")), f"no joint is driven by the bus '{bus}'"
        is_known = context.knows(place, bus, set(driven.values()), message, "buses of this robot")
    if not is_known:
        return None
    return EventDeed(FAULT, request=InjectFault(model.fault, joint, model.for_), component=bus or driven[joint])


def read_expect(context: TrialContext, node: TreeNode | None, model: trials.ExpectModel) -> Expectations:
    """Return the expectations."""
    root = node or MappingNode()
    _check_outcome(context, root, model)
    expect = Expectations(
        model.outcome or "",
        value_span(root, ("outcome",)),
        model.for_,
        tuple(_steps(context, at(root, ("steps",)))),
        tuple(_steps(context, at(root, ("never",)))),
        tuple(_counts(context, at(root, ("count",)), model.count)),
        tuple(_data(context, at(root, ("data",)))),
        tuple(_published(context, at(root, ("published",)), model.published)),
        tuple(ExpectedValue(text, text, value_span(root, ("reports", i))) for i, text in enumerate(model.reports)),
    )
    for step in expect.steps:
        if model.for_ is not None and step.at is not None and step.at > model.for_:
            context.report.add(codes.NEVER.at(step.span, "this is after the end of the test ('for')"))
    context.report.extend(contradictions(expect))
    return expect


def _check_outcome(context: TrialContext, root: TreeNode, model: trials.ExpectModel) -> None:
    if model.outcome is not None:
        message = f"the mission '{context.program.name}' has no outcome '{model.outcome}'"
        ends = {**context.facts.ends, RUNS: RUNS}
        context.knows(value_span(root, ("outcome",)), model.outcome, ends, message, "its outcomes")
    if model.outcome == RUNS and model.for_ is None:
        help_text = "write 'for: 60 s' beside it: how long the mission is watched"
        context.report.add(codes.NEVER.at(key_span(root, ("outcome",)), "every test of a mission ends", help=help_text))


def _steps(context: TrialContext, node: TreeNode | None) -> list[ExpectedStep]:
    items = node.items if isinstance(node, SequenceNode) else ()
    return [step for item in items if (step := _step(context, item))]


def _step(context: TrialContext, node: TreeNode) -> ExpectedStep | None:
    """Read one step: a word, or a map with one name besides `ended` and `at`."""
    entries = dict(entries_of(node))
    if isinstance(node, ScalarNode):
        entries = {node.text: Entry(node, ScalarNode("", node.span))}
    names = [key for key in entries if key not in STEP_KEYS]
    if len(names) != 1 or not names[0]:
        message = "this is not a step" if not names else f"a step has one name, this has {len(names)}"
        context.report.add(codes.NO_STEP.at(node.span, message, help=STEP_HELP))
        return None
    name = names[0]
    entry = entries[name]
    if not context.knows_step(entry.key):
        return None
    when = validate(Time, entries["at"].value, ("at",), context.report) if "at" in entries else None
    arguments = _arguments(context, name, entry.value)
    text = name if isinstance(entry.value, ScalarNode) and not entry.value.text else f"{name} {brief(entry.value)}"
    if isinstance(entry.value, MappingNode):
        text = " ".join([name, *(f"{key} {brief(one.value)}" for key, one in entry.value.entries.items())])
    counts_as = context.facts.steps[name]
    return ExpectedStep(name, entry.key.span, arguments, _ended(context, name, entries), when, text, counts_as)


def _ended(context: TrialContext, name: str, entries: Mapping[str, Entry]) -> str:
    node = entries["ended"].value if "ended" in entries else None
    if node is None:
        return ""
    word = text_at(node)
    known = {**ENDS, RUNS: RUNS, **context.facts.steps[name]}
    message = f"'{name}' does not end with '{word}'" if word else "'ended' needs a word"
    context.knows(node.span, word, known, message, "how it may end")
    return word


def _arguments(context: TrialContext, name: str, node: TreeNode) -> dict[str, Value]:
    """Return the expected arguments of a call; a single value is the main one."""
    if isinstance(node, ScalarNode) and node.plain and not node.text:
        return {}
    skill = context.facts.skills.get(name)
    if skill is None:
        context.report.add(codes.NO_STEP.at(node.span, f"'{name}' is not a skill, so it has no arguments"))
        return {}
    is_map, nothing = isinstance(node, MappingNode), "single value" if skill.arguments else "argument"
    written = {key: entry.value for key, entry in entries_of(node).items()} if is_map else {skill.main: node}
    found: dict[str, Value] = {}
    for key, value in written.items():
        message = f"the skill '{name}' has no argument '{key}'" if key else f"the skill '{name}' takes no {nothing}"
        if context.knows(key_span(node, (key,)), key, skill.arguments, message, "its arguments"):
            found[key] = context.value(value, skill.arguments[key], f"the argument '{key}'")
    return found


def _counts(context: TrialContext, node: TreeNode | None, counts: Mapping[str, int]) -> list[ExpectedValue]:
    found = []
    for name, entry in entries_of(node).items():
        if not context.knows_step(entry.key):
            continue
        if counts.get(name, -1) < 0:
            context.report.add(codes.NEVER.at(entry.value.span, "a count cannot be below 0"))
        else:
            found.append(ExpectedValue(name, counts[name], entry.key.span))
    return found


def _data(context: TrialContext, node: TreeNode | None) -> list[ExpectedValue]:
    found = []
    for name, entry in entries_of(node).items():
        wanted = context.type_of_datum(name)
        if wanted is None:
            message, known = f"the mission '{context.program.name}' has no datum '{name}'", context.program.data
            context.report.add(codes.UNKNOWN.misspelt(entry.key.span, message, name, known, "its data"))
            continue
        value = context.value(entry.value, wanted, f"the datum '{name}'")
        found.append(ExpectedValue(name, value, entry.key.span))
    return found


def _published(
    context: TrialContext, node: TreeNode | None, models: Sequence[trials.SentModel]
) -> list[ExpectedMessage]:
    found, root = [], node or MappingNode()
    known = {topic.strip("/"): topic for topic in context.facts.topics}
    for index, model in enumerate(models):
        span: Span = value_span(root, (index, "topic"))
        topic = known.get(model.topic.strip("/"))
        if topic is None:
            message = f"the mission '{context.program.name}' does not publish on '{model.topic}'"
            context.report.add(codes.UNKNOWN.misspelt(span, message, model.topic, known, "its topics"))
            continue
        found.append(ExpectedMessage(topic, _fields(context, topic, at(root, (index, "message"))), span))
    return found


def _fields(context: TrialContext, topic: str, node: TreeNode | None) -> dict[str, Value]:
    """Return the expected fields of a message; a single value means the only one."""
    if node is None:
        return {}
    fields = registry.message(context.names.topics[topic]).FIELDS
    value = literal(node).value
    written = value if isinstance(value, dict) else {next(iter(fields)): value}
    for name in written:
        message = f"the messages on '{topic}' have no field '{name}'"
        context.knows(key_span(node, (name,)), name, fields, message, "their fields")
    return written


def read_events(
    context: TrialContext, node: TreeNode | None, models: Sequence[trials.EventModel]
) -> tuple[TrialEvent, ...]:
    """Return the events in the order of the text."""
    items = node.items if isinstance(node, SequenceNode) else ()
    return tuple(_event(context, item, model) for item, model in zip(items, models, strict=False))


def _event(context: TrialContext, node: TreeNode, model: trials.EventModel) -> TrialEvent:
    words = [word for word, _ in entries_of(node).items() if word != AT]
    if not words:
        context.report.add(codes.NEVER.at(node.span, "nothing happens here", help="give 'set', 'publish', 'stop', ..."))
    deeds = (_deed(context, word, node, model) for word in words)
    return TrialEvent(model.at, tuple(deed for deed in deeds if deed), value_span(node, (AT,)))


def _deed(context: TrialContext, word: str, node: TreeNode, model: trials.EventModel) -> EventDeed | None:
    if word == SET:
        return EventDeed(SET, context.settings(at(node, (SET,)), {}))
    if word == PUBLISH and model.publish:
        return _published_by_event(context, node, model.publish)
    if word == FAULT and model.fault:
        return read_fault(context, node, model.fault)
    return EventDeed(word)


def _published_by_event(context: TrialContext, node: TreeNode, sent: trials.SentModel) -> EventDeed | None:
    """Return a message for a topic that has a publisher or subscriber."""
    topics, topic = _topics(context), resolve(sent.topic, context.robot.manifest.bus.namespace or "")
    if topic not in topics:
        message = f"no component has the topic '{sent.topic}'"
        span, known = value_span(node, (PUBLISH, "topic")), [name.removeprefix("/") for name in topics]
        context.report.add(codes.UNKNOWN.misspelt(span, message, sent.topic, known, "topics of this robot"))
        return None
    cls, place = registry.message(topics[topic]), (PUBLISH, "message")
    written = at(node, place)
    data = {} if written is None else to_plain(written)
    if not isinstance(data, dict):
        data = {next(iter(cls.FIELDS)): data}
    made, findings = from_plain(cls, data, NodePlaces(node, place))
    context.report.extend(findings)
    return EventDeed(PUBLISH, topic=topic, message=made) if made is not None else None


def _topics(context: TrialContext) -> dict[str, str]:
    """Return the absolute names of topics with their types: those of components, and those of values."""
    namespace = context.robot.manifest.bus.namespace or ""
    own = {resolve(name, namespace): message for name, message in context.names.topics.items()}
    return {**own, **{source.topic: source.message for source in context.robot.values.values()}}


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

    `unsaved` are texts in place of files, by their real paths. `sources` are the texts of all files, `report` has the
    findings on robots, `robots` has these by file and profile.
    """

    environment: Mapping[str, str]
    unsaved: Mapping[Path, str] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    report: Report = field(default_factory=Report)
    robots: dict[tuple[str, str], Compilation] = field(default_factory=dict)
    _kept_back: dict[Finding, str] = field(default_factory=dict)  # the finding in a test of a robot with errors

    def read(self, path: Path) -> tuple[Trial | None, Report]:
        """Return the test of a file, None if the test or its robot has errors; and the findings for all its robots."""
        every = self.every(path)
        trials = [self.understand(trial) for trial in every]
        findings = dict.fromkeys(finding for trial in every for finding in trial.report)
        return trials[0], Report([*findings])

    def every(self, path: Path) -> list[WrittenTrial]:
        """Return the contents of a file for each robot with which it runs; the names of further ones name the robot."""
        first = self.open(path)
        node = first.root.get("also") if first.root is not None else None
        if first.root is None or node is None:
            return [first]
        robots = node.items if isinstance(node, SequenceNode) else ()
        if not robots or not all(isinstance(robot, ScalarNode) and robot.text for robot in robots):
            first.report.add(WRONG_TYPE.at(node.span, "'also' must be a list of robots", label=label_of(node)))
            return [first]
        names = first.root.entries
        own = names["robot"].key if "robot" in names else names["also"].key
        roots = [replace(first.root, entries={**names, "robot": Entry(own, robot)}) for robot in robots]
        shown = [f"{first.name} ({_name_of(robot)})" for robot in robots if isinstance(robot, ScalarNode)]
        return [first, *(WrittenTrial(path, name, root, Report()) for name, root in zip(shown, roots, strict=True))]

    def open(self, path: Path) -> WrittenTrial:
        """Return the contents of a file for its first robot; a test without a name gets that of its file."""
        report = Report()
        sources = Texts(self.unsaved)
        root = Documents(report, sources).read(path, TEST)
        self.sources.update(sources)
        return WrittenTrial(path, text_at(root, ("name",)) or path.name, root, report)

    def understand(self, written: WrittenTrial) -> Trial | None:
        """Return the test that a file contains, None if it cannot run; add its findings to its report."""
        root, report = written.root, written.report
        if root is None:
            return None
        documents = Documents(report, self.sources)
        root = documents.placed(TrialFile, root, SECTIONS)
        documents.check(TrialFile, _without_values(root))
        found = self._robot(root, written.path, report)
        if found is None:
            return None
        trial = _read(root, written.name, *found, report)
        if trial is not None and not report.has_errors:
            report.extend(_with_its_inputs(root, found[0], trial))
        return None if report.has_errors else trial

    def summed_up(self, findings: Iterable[Finding]) -> Iterator[Finding]:
        """Yield the findings, but merge those of all tests that the same robot with errors keeps from running."""
        kept_back: dict[str, list[Finding]] = {}
        for finding in Report(list(findings)):
            if finding in self._kept_back:
                kept_back.setdefault(self._kept_back[finding], []).append(finding)
            else:
                yield finding
        for robot, ones in kept_back.items():
            which = "the test" if len(ones) == 1 else f"{len(ones)} tests"
            yield replace(ones[0], message=_no_robot(robot, which))

    def _robot(self, root: MappingNode, path: Path, report: Report) -> tuple[Robot, Plan] | None:
        """Return the robot and its plan; None if it cannot be found, or has errors outside of its other missions."""
        written = _text(root, "robot", "the robot's file", report)
        if written is None:
            return None
        file = (
            written.text
            if written.text.startswith(PREFIX)
            else resolve_file(written.text, path, written.span, may_be_robot=True)
        )
        if isinstance(file, Finding):
            report.add(file)
            return None
        name = str(file)
        shown = name if isinstance(file, str) else shown_name(file)
        chosen = _text(root, "profile", "the name of a profile", report) if "profile" in root else None
        key = name, chosen.text if chosen is not None else ""
        if key not in self.robots:
            profiles = [chosen.text] if chosen is not None else []
            made = compile_robot(shown, profiles=profiles, environment=self.environment, unsaved=self.unsaved)
            self.robots[key] = made
            self.report.extend(finding for finding in made.report if not _is_of_profile(finding))
            self.sources.update(made.sources)
        made = self.robots[key]
        if made.robot is not None:
            registry.choose(made.robot.manifest.messages)
        lost = [finding for finding in made.report if _is_of_profile(finding)]
        if chosen is not None and lost:
            none = "remove it: the robot has no profiles"
            report.extend(replace(finding, span=chosen.span, help=finding.help or none, fix=None) for finding in lost)
            return None
        found = robot_for_mission(made, text_at(root, ("mission",)))
        if found is None:
            why = codes.NEVER.at(written.span, _no_robot(shown, "the test"), help="see the findings of the robot")
            self._kept_back[why] = shown
            report.add(why)
        return found


def _name_of(robot: ScalarNode) -> str:
    """Return what a robot's file is called: its folder, if the file is called as those of all robots are."""
    path = PurePosixPath(robot.text.removeprefix(PREFIX))
    return path.parent.name if path.name == ROBOT_FILE else path.stem


def _is_of_profile(finding: Finding) -> bool:
    """Return whether a finding is about the profile that was chosen, and in no file of the robot."""
    return finding.span is not None and finding.span.file == PROFILE


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


def _read(root: MappingNode, name: str, robot: Robot, plan: Plan, report: Report) -> Trial | None:
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
    _check_times(events, expect.until, report)
    is_complete = _is_complete(context.facts, mocks, events)
    if is_complete:
        report.extend(_faults_without_servos(events))
    return Trial(name, chosen.text, program, linked, robot, plan, inputs, mocks, events, expect, is_complete)


def _with_its_inputs(root: MappingNode, robot: Robot, trial: Trial) -> Iterator[Finding]:
    """Yield what is wrong with the mission only because of the inputs that the test gives to it.

    A test that mocks skills, or expects another end than success, may give any.
    """
    written, mission = root.get("with"), robot.missions[trial.mission]
    if trial.mocks or trial.expect.outcome != SUCCEEDS or not isinstance(written, MappingNode):
        return
    spans = {name: entry.value.span for name, entry in written.entries.items()}
    own = replace(mission, inputs=trial.inputs, given={**mission.given, **spans})
    if not (found := _findings_of(robot, own)):
        return
    known = {(finding.code, finding.message) for finding in _findings_of(robot, mission)}
    place = next(iter(spans.values())) if len(spans) == 1 else key_span(root, ("with",))
    for finding in found:
        if (finding.code, finding.message) not in known and finding.span is not None:
            if finding.span.file != place.file:
                there = Related(finding.span, "with the inputs of the test")
                finding = replace(finding, span=place, related=(there, *finding.related))
            yield replace(finding, fix=None)


def _findings_of(robot: Robot, mission: RobotMission) -> list[Finding]:
    report = Report()
    with one_compile():
        run_checks(replace(robot, missions={**robot.missions, mission.name: mission}), report)
    return report.findings


def _faults_without_servos(events: tuple[TrialEvent, ...]) -> Iterator[Finding]:
    """Yield a finding for each fault of a test that needs no robot."""
    for event in events:
        if any(deed.word == FAULT for deed in event.deeds):
            message = "the test answers all that the mission needs, so no servo runs that could have a fault"
            yield codes.NEVER.at(event.span, message, help="leave a skill, a service or a value to the robot")


def _is_complete(facts: MissionFacts, mocks: Mapping[str, Mock], events: tuple[TrialEvent, ...]) -> bool:
    """Return whether the mission needs only what the test provides, and nothing is sent over the bus."""
    deeds = [deed for event in events for deed in event.deeds]
    values = {name for deed in deeds for name in deed.settings}
    values |= {name for mock in mocks.values() for name in mock.sets}
    is_answered = {*facts.skills, *facts.services} <= mocks.keys()
    return is_answered and facts.values <= values and not any(deed.word == PUBLISH for deed in deeds)


def _there(root: MappingNode) -> list[tuple[str, Any]]:
    """Return the sections that are not empty, with their models."""
    return [(key, model) for key, model in SECTIONS.items() if key in root and not _is_empty(root.entries[key].value)]


def _is_empty(node: TreeNode) -> bool:
    if isinstance(node, MappingNode):
        return not node.entries
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


def _check_times(events: tuple[TrialEvent, ...], until: float | None, report: Report) -> None:
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
