"""Branches of a parallel and cases of a value."""

from collections.abc import Iterator
from itertools import combinations

from rbxcompose.base.expressions.check import check
from rbxcompose.base.expressions.tree import Expression, Flag, Number, Text, Word, walk
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.findings import OWN, Finding, Related, Severity, Span
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined, claims_below
from rbxcompose.missions.language.asked import Asked, inner_span
from rbxcompose.missions.program.branches import ALL, Branches, compared_with_word
from rbxcompose.missions.program.outcomes import FAILS, SUCCEEDS, Outcomes
from rbxcompose.missions.program.program import MissionNode


@mission_check("RBX4138", Severity.WARNING, closed=(OWN,))
def endless_branch(mission: Examined) -> Iterator[Finding]:
    """A parallel waits for a branch that never succeeds."""
    program, ending = mission.program, mission.ending
    for node in program.nodes:
        branches = node.step.branches
        if branches is None or branches.ends_with:
            continue
        endless = [child for child in node.children if not ending.of(child).counting_as(SUCCEEDS)]
        others = [child for child in node.children if child not in endless]
        endless = [child for child in endless if not any(node.step.ends_mission for node in program.below(child))]
        if endless and others and _most_wanted(node, branches) > len(others):
            yield endless_branch.at(
                program.nodes[endless[0]].span,
                "this branch never succeeds, and the parallel waits for it",
                help="write 'ends_with' and the name of the branch that decides, or 'succeed_when: any'",
                related=[Related(program.nodes[others[0]].span, "beside this one")],
            )


def _most_wanted(node: MissionNode, branches: Branches) -> float:
    """Return how many branches must succeed; 0 if the text does not say."""
    if branches.succeed_when == ALL:
        return len(node.children)
    tree = branches.succeed_when.tree if isinstance(branches.succeed_when, Expression) else None
    return tree.value if isinstance(tree, Number) else 0


@mission_check("RBX4135", Severity.WARNING, closed=(OWN,))
def impossible_result(mission: Examined) -> Iterator[Finding]:
    """A branch is compared with a result that it cannot have."""
    for node in mission.program.nodes:
        ends = mission.ending.of_branches(node)
        for outcome in node.step.branches.outcomes if node.step.branches else ():
            for tree, _ in walk(outcome.condition.tree) if outcome.condition else ():
                branch, word = compared_with_word(tree) or ("", None)
                result = word.name if word else ""
                if outcome.asked and _is_impossible(ends.get(branch), result):
                    yield impossible_result.at(
                        inner_span(outcome.asked.scalar, tree.start, tree.end),
                        f"the branch '{branch}' never ends with '{result}'",
                        help=f"it ends with {' or '.join(ends[branch].words) or 'nothing: it runs for ever'}",
                    )


def _is_impossible(ends: Outcomes | None, result: str) -> bool:
    return ends is not None and result in (SUCCEEDS, FAILS) and not ends.counting_as(result)


WORDS = (TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE)
NUMBERS = (TypeKind.QUANTITY, TypeKind.COUNT)


@mission_check("RBX4154", Severity.WARNING, closed=())
def same_case(mission: Examined) -> Iterator[Finding]:
    """A case that is never taken."""
    for view in mission.views:
        choice = view.node.step.choice
        if choice is None:
            continue
        chosen, _ = check(choice.asked, view.scope)
        seen: dict[object, Asked] = {}
        for asked in choice.cases:
            value, text = _constant(asked.expression), asked.scalar.text
            if value in seen:
                related = [Related(seen[value].scalar.span, "the first one")]
                message = f"the case '{text}' is never taken: an earlier one is equal"
                yield same_case.at(asked.scalar.span, message, related=related)
            elif value is not None:
                seen[value] = asked
                if not _can_be(asked.expression, chosen):
                    message = f"the case '{text}' is never taken: '{choice.asked.text}' is {chosen.detail}"
                    yield same_case.at(asked.scalar.span, message)


def _constant(expression: Expression) -> object:
    """Return the value of a case if it is a literal; a word and a text of the same letters are the same."""
    match expression.tree:
        case Number(value=value) | Text(value=value):
            return value
        case Flag(value=value):
            return str(value)
        case Word(name=name):
            return name
    return None


def _can_be(case: Expression, chosen: Type) -> bool:
    """Return whether a value of the type `chosen` can equal a literal case."""
    if chosen.kind not in (*WORDS, *NUMBERS, TypeKind.FLAG):
        return True
    match case.tree:
        case Number(dimension=dimension):
            return chosen.kind in NUMBERS and dimension == chosen.measure
        case Flag():
            return chosen.kind is TypeKind.FLAG
        case Text(value=word) | Word(name=word):
            return chosen.kind in WORDS and (not chosen.choices or word in chosen.choices)
    return True


@mission_check("RBX4152", Severity.WARNING, closed=())
def same_claim(mission: Examined) -> Iterator[Finding]:
    """Two branches of a parallel need the same part of the robot."""
    program, robot = mission.program, mission.robot
    for node in program.nodes:
        if node.step.branches is None:
            continue
        claimed: dict[str, list[Span]] = {}  # by what is claimed, a span for each branch
        for child in node.children:
            for resource, span in dict(claims_below(program.below(child), robot)).items():
                claimed.setdefault(resource, []).append(span)
        for resource, spans in claimed.items():
            for first, second in combinations(spans, 2):
                yield same_claim.at(
                    second,
                    f"two branches that run at the same time need the {resource}",
                    help="do one after the other",
                    related=[Related(first, "the other one")],
                )


@mission_check("RBX4153")
def too_many(mission: Examined) -> Iterator[Finding]:
    """A parallel counts more branches than it has."""
    for node in mission.program.nodes:
        branches = node.step.branches
        if branches is None:
            continue
        for key, wanted in (("succeed_when", branches.succeed_when), ("fail_when", branches.fail_when)):
            tree = wanted.tree if isinstance(wanted, Expression) else None
            if isinstance(tree, Number) and tree.value > len(node.children) > 0:
                span = next(asked.scalar.span for asked in node.asked if asked.expression is wanted)
                message = f"'{key}' counts {tree.value:.0f} branches; there are {len(node.children)}"
                yield too_many.at(span, message)
