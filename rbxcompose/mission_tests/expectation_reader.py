"""Reads `expect`: what must have happened in the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rbxcompose.config import Time
from rbxcompose.expressions.types import UNKNOWN
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Span
from rbxcompose.manifest import test_file as trials
from rbxcompose.manifest.test_file import STEP_KEYS
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, at, key_span, value_span
from rbxcompose.manifest.validate import validate
from rbxcompose.mission_tests import codes
from rbxcompose.mission_tests.contradictions import contradictions
from rbxcompose.mission_tests.model import (
    FAILS,
    HALTED,
    RUNS,
    SKIPPED,
    SUCCEEDS,
    Expectations,
    ExpectedMessage,
    ExpectedStep,
    ExpectedValue,
)
from rbxcompose.mission_tests.scope import read_value
from rbxcompose.mission_tests.sections import TrialContext, entries_of
from rbxcompose.missions.analysis.held_nodes import brief
from rbxcompose.missions.language.literals import literal
from rbxcompose.msgs import registry

STEP_HELP = "write the name of a skill, a node or a state, such as '- go_to: corner_1'"
ENDS = {one: one for one in (SUCCEEDS, FAILS, HALTED, SKIPPED)}


def read_expect(context: TrialContext, node: TreeNode | None, model: trials.ExpectModel) -> Expectations:
    """Return the expectations."""
    root = node or MappingNode()
    _look_at_outcome(context, root, model)
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


def _look_at_outcome(context: TrialContext, root: TreeNode, model: trials.ExpectModel) -> None:
    report, ends = context.report, {**context.facts.ends, RUNS: RUNS}
    if model.outcome is not None and model.outcome not in ends:
        message = f"the mission '{context.program.name}' has no outcome '{model.outcome}'"
        span = value_span(root, ("outcome",))
        report.add(codes.UNKNOWN.misspelt(span, message, model.outcome, ends, "its outcomes"))
    if model.outcome == RUNS and model.for_ is None:
        help_text = "write 'for: 60 s' beside it: how long the mission is watched"
        report.add(codes.NEVER.at(key_span(root, ("outcome",)), "every test of a mission ends", help=help_text))


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
    name, steps = names[0], context.facts.steps
    entry = entries[name]
    if name not in steps:
        message = f"the mission '{context.program.name}' has no step '{name}'"
        context.report.add(codes.UNKNOWN.misspelt(entry.key.span, message, name, steps, "its steps"))
        return None
    when = validate(Time, entries["at"].value, ("at",), context.report) if "at" in entries else None
    arguments = _arguments(context, name, entry.value)
    text = name if isinstance(entry.value, ScalarNode) and not entry.value.text else f"{name} {brief(entry.value)}"
    if isinstance(entry.value, MappingNode):
        text = " ".join([name, *(f"{key} {brief(one.value)}" for key, one in entry.value.entries.items())])
    return ExpectedStep(name, entry.key.span, arguments, _ended(context, name, entries), when, text, steps[name])


def _ended(context: TrialContext, name: str, entries: Mapping[str, Entry]) -> str:
    node = entries["ended"].value if "ended" in entries else None
    if node is None:
        return ""
    word = node.text if isinstance(node, ScalarNode) else ""
    known = {**ENDS, RUNS: RUNS, **context.facts.steps[name]}
    if word not in known:
        message = f"'{name}' does not end with '{word}'" if word else "'ended' needs a word"
        context.report.add(codes.UNKNOWN.misspelt(node.span, message, word, known, "how it may end"))
    return word


def _arguments(context: TrialContext, name: str, node: TreeNode) -> dict[str, Value]:
    """Return the expected arguments of a call; a single value is the main one."""
    if isinstance(node, ScalarNode) and node.plain and not node.text:
        return {}
    skill = context.facts.skills.get(name)
    if skill is None:
        context.report.add(codes.NO_STEP.at(node.span, f"'{name}' is not a skill, so it has no arguments"))
        return {}
    written = {key: one.value for key, one in entries_of(node)} if isinstance(node, MappingNode) else {skill.main: node}
    found: dict[str, Value] = {}
    for key, value in written.items():
        if key not in skill.arguments:
            nothing = "single value" if skill.arguments else "argument"
            message = f"the skill '{name}' has no argument '{key}'" if key else f"the skill '{name}' takes no {nothing}"
            span = key_span(node, (key,))
            context.report.add(codes.UNKNOWN.misspelt(span, message, key, skill.arguments, "its arguments"))
            continue
        found[key], findings = read_value(value, skill.arguments[key], context.names, f"the argument '{key}'")
        context.report.extend(findings)
    return found


def _counts(context: TrialContext, node: TreeNode | None, counts: Mapping[str, int]) -> list[ExpectedValue]:
    found = []
    for name, entry in entries_of(node):
        if name not in context.facts.steps:
            message = f"the mission '{context.program.name}' has no step '{name}'"
            context.report.add(codes.UNKNOWN.misspelt(entry.key.span, message, name, context.facts.steps, "its steps"))
        elif counts.get(name, -1) < 0:
            context.report.add(codes.NEVER.at(entry.value.span, "a count cannot be below 0"))
        else:
            found.append(ExpectedValue(name, counts[name], entry.key.span))
    return found


def _data(context: TrialContext, node: TreeNode | None) -> list[ExpectedValue]:
    found = []
    for name, entry in entries_of(node):
        wanted = context.type_of_datum(name)
        if wanted is None:
            message, known = f"the mission '{context.program.name}' has no datum '{name}'", context.program.data
            context.report.add(codes.UNKNOWN.misspelt(entry.key.span, message, name, known, "its data"))
            continue
        value, findings = read_value(entry.value, wanted or UNKNOWN, context.names, f"the datum '{name}'")
        context.report.extend(findings)
        found.append(ExpectedValue(name, value, entry.key.span))
    return found


def _published(
    context: TrialContext, node: TreeNode | None, models: Sequence[trials.SentModel]
) -> list[ExpectedMessage]:
    found = []
    for index, model in enumerate(models):
        span: Span = value_span(node or MappingNode(), (index, "topic"))
        known = {topic.strip("/"): topic for topic in context.facts.topics}
        if model.topic.strip("/") not in known:
            message = f"the mission '{context.program.name}' does not publish on '{model.topic}'"
            context.report.add(codes.UNKNOWN.misspelt(span, message, model.topic, known, "its topics"))
            continue
        topic = known[model.topic.strip("/")]
        found.append(
            ExpectedMessage(topic, _fields(context, topic, at(node or MappingNode(), (index, "message"))), span)
        )
    return found


def _fields(context: TrialContext, topic: str, node: TreeNode | None) -> dict[str, Value]:
    """Return the expected fields of a message; a single value means the only one."""
    if node is None:
        return {}
    fields = registry.message(context.names.topics[topic]).FIELDS
    value = literal(node).value
    written = value if isinstance(value, dict) else {next(iter(fields)): value}
    for name in written.keys() - fields.keys():
        message = f"the messages on '{topic}' have no field '{name}'"
        context.report.add(codes.UNKNOWN.misspelt(key_span(node, (name,)), message, name, fields, "their fields"))
    return written
