"""Reads `mocks`: the skills and services that a test answers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.expressions.types import UNKNOWN
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Finding
from rbxcompose.manifest import test_file as trials
from rbxcompose.manifest.tree import Entry, KeyPath, SequenceNode, TreeNode, at, value_span
from rbxcompose.mission_tests import codes
from rbxcompose.mission_tests.model import FAILS, SUCCEEDS, Mock
from rbxcompose.mission_tests.scope import read_value
from rbxcompose.mission_tests.sections import TrialContext, entries_of
from rbxcompose.missions.program.program import Skill


def read_mocks(context: TrialContext, node: TreeNode | None, models: Mapping[str, trials.MockModel]) -> dict[str, Mock]:
    """Return the mocks by the name of the skill or service that they replace."""
    return {name: _mock(context, name, entry, models[name]) for name, entry in entries_of(node) if name in models}


def _mock(context: TrialContext, name: str, entry: Entry, model: trials.MockModel) -> Mock:
    report, names, value = context.report, context.names, entry.value
    if name not in names.skills and name not in names.services:
        message, valid = f"the robot has no skill or service '{name}'", {**names.skills, **names.services}
        report.add(codes.UNKNOWN.misspelt(entry.key.span, message, name, valid, "skills of this robot"))
    elif name not in context.facts.skills and name not in context.facts.services:
        message = f"the mission '{context.program.name}' does not use '{name}'"
        report.add(codes.UNUSED_MOCK.at(entry.key.span, message))
    skill = names.skills.get(name, Skill(name))
    outcomes = {SUCCEEDS: SUCCEEDS, FAILS: FAILS, **skill.outcomes}
    report.extend(_outcomes(value, model, outcomes))
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


def _outcomes(value: TreeNode, model: trials.MockModel, outcomes: Mapping[str, str]) -> Iterator[Finding]:
    """Yield the findings on the outcomes."""
    written: dict[KeyPath, str] = {("result",): model.result}
    written |= {("outcome_at", call): outcome for call, outcome in model.outcome_at.items()}
    for path, outcome in written.items():
        if outcome not in outcomes:
            message = f"there is no outcome '{outcome}'"
            yield codes.UNKNOWN.misspelt(value_span(value, path), message, outcome, outcomes, "outcomes")


def _values(context: TrialContext, skill: Skill, node: TreeNode | None) -> list[Value]:
    """Return the values of the main argument for which calls fail."""
    if not isinstance(node, SequenceNode):
        return []
    if not skill.main:
        what = "single value" if skill.arguments else "argument"
        context.report.add(codes.NEVER.at(node.span, f"'{skill.name}' takes no {what}"))
        return []
    found: list[Value] = []
    for item in node.items:
        wanted = skill.arguments.get(skill.main, UNKNOWN)
        value, findings = read_value(item, wanted, context.names, f"the argument '{skill.main}'")
        context.report.extend(findings)
        found.append(value)
    return found
