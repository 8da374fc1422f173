"""Types of conditions and values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from rbxcompose.expressions.check import check
from rbxcompose.expressions.tree import Number, walk
from rbxcompose.expressions.types import COUNT, PLACE, TEXT, UNKNOWN, Type, TypeKind, choice_of, quantity_of
from rbxcompose.findings import Finding, Related
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import assignments
from rbxcompose.missions.analysis.endings import Ending
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.scope_types import View, findings_of
from rbxcompose.missions.codes import UNKNOWN_NAME, WRONG_TYPE
from rbxcompose.missions.language.asked import Asked, Assignment
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.missions.program.branches import RESULTS, compared_with_word
from rbxcompose.missions.program.outcomes import Outcomes
from rbxcompose.units import NUMBER

LISTED = (TypeKind.LIST, TypeKind.MAP, TypeKind.UNKNOWN)
NUMBERS = (TypeKind.QUANTITY, TypeKind.COUNT)


@mission_check(WRONG_TYPE)
def wrong_type(mission: Examined) -> Iterator[Finding]:
    """Yield the expressions that have the wrong type, or name something that does not exist."""
    for view in mission.views:
        for asked in view.node.asked:
            if not asked.is_assigned:
                yield from view.typed(asked.expression, asked.wanted, asked.scalar, WRONG_TYPE)
        for assignment in assignments(view.node):
            yield from _assigned(view, assignment)
        yield from _not_listed(view)
        yield from _other_cases(view)
        yield from _outcomes(view, mission.ending)
    whole = [*(interrupt.when for interrupt in mission.program.interrupts), *mission.program.outputs.values()]
    for asked in whole:
        yield from findings_of(asked.expression, asked.wanted, asked.scalar, mission.scope, WRONG_TYPE)


def _assigned(view: View, assignment: Assignment) -> Iterator[Finding]:
    """Yield a finding if a value does not fit its datum.

    A count accepts any number, also within a list or a map: `sum: 0` under `data` does not say that it stays whole. And
    a text accepts a place: `room: dock` is both a text and the name of a place.
    """
    asked, data = assignment.asked, view.program.data
    datum = data.get(assignment.name)
    wanted = _with_numbers(datum.type if datum else UNKNOWN)
    found, problems = check(asked.expression, view.scope)
    if wanted == TEXT and found == PLACE:
        wanted = PLACE
    for finding in view.typed(asked.expression, wanted, asked.scalar, WRONG_TYPE):
        if datum is None or finding.help or problems or finding.code != WRONG_TYPE.code:
            yield finding
            continue
        help_text = f"a datum keeps the type of its first value: give '{assignment.name}' one of this type under 'data'"
        yield replace(finding, help=help_text, related=(*finding.related, Related(datum.span, "its first value")))


def _with_numbers(wanted: Type) -> Type:
    """Return a type with any number in place of counts."""
    if wanted == COUNT:
        return quantity_of(NUMBER)
    return replace(wanted, of=_with_numbers(wanted.of)) if wanted.of else wanted


def _not_listed(view: View) -> Iterator[Finding]:
    """Yield a finding if a loop iterates over something that is neither a list nor a map."""
    items = view.node.step.items
    if items is not None and not isinstance(items, tuple) and view.node.asked:
        found, _ = check(items, view.scope)
        if found.kind not in LISTED:
            message = f"'in' must be a list or a map; it is {found.phrase}"
            times = f"to do it {items.text} times, write 'repeat: {items.text}' instead of 'for' and 'in'"
            help_text = times if found == COUNT else "write a list: '[...]'"
            yield WRONG_TYPE.at(view.node.asked[0].scalar.span, message, help=help_text)


def _other_cases(view: View) -> Iterator[Finding]:
    """Yield the cases whose dimension differs from that of the value to choose by."""
    choice = view.node.step.choice
    if choice is None:
        return
    chosen, _ = check(choice.asked, view.scope)
    for case in choice.cases if chosen.kind in NUMBERS else ():
        tree = case.expression.tree
        if isinstance(tree, Number) and tree.dimension != chosen.measure:
            message = f"the case is {tree.dimension.phrase}; '{choice.asked.text}' is {chosen.phrase}"
            yield WRONG_TYPE.at(case.scalar.span, message)


def _outcomes(view: View, ending: Ending) -> Iterator[Finding]:
    """Yield the findings about the conditions over the branches of a parallel."""
    branches = view.node.step.branches
    if branches is None or not branches.outcomes:
        return
    names, branch_ends = dict(view.scope.names), ending.of_branches(view.node)
    for branch, ends in branch_ends.items():
        names[branch] = choice_of(*RESULTS, *(word for word in ends.named if word not in RESULTS))
    scope = replace(view.scope, names=names)
    for outcome in branches.outcomes:
        if asked := outcome.asked:
            found = list(findings_of(asked.expression, asked.wanted, asked.scalar, scope, WRONG_TYPE))
            unknown = [one for one in found if one.code == UNKNOWN_NAME.code]
            others = (_with_results(one, asked, branch_ends) for one in found)
            yield from unknown or others  # the word compared with a misspelt branch would count as an unknown place


def _with_results(finding: Finding, asked: Asked, ends: Mapping[str, Outcomes]) -> Finding:
    """Return a finding about a word that is no result, with the results of the branch that it is compared with."""
    for part, _ in walk(asked.expression.tree):
        branch, word = compared_with_word(part) or ("", None)
        if word and branch in ends and finding.span == inner_span(asked.scalar, word.start, word.end):
            results = ends[branch].words
            told = f"it ends with {' or '.join(results)}" if results else "it never ends"
            return replace(finding, message=f"the branch '{branch}' never ends with '{word.name}'", help=told)
    return finding
