"""Results: of branches, of the states of machines, and those that are saved."""

from collections.abc import Iterator
from itertools import combinations

from rbxcompose.base.expressions.check import check
from rbxcompose.base.expressions.tree import Expression, Flag, Number, Text, Word, walk
from rbxcompose.base.expressions.types import UNKNOWN, Type, TypeKind, accepts, map_of
from rbxcompose.base.findings import DID_YOU_MEAN, OWN, Finding, Related, Severity, Span, replacement
from rbxcompose.missions.analysis.examined import (
    Examined,
    claims_below,
    leading_to,
    mission_check,
    reached,
    transitions,
)
from rbxcompose.missions.analysis.facts import compared_with_word, written
from rbxcompose.missions.language.grammar import OUTCOMES
from rbxcompose.missions.program.outcomes import FAILS, SUCCEEDS, Outcomes
from rbxcompose.missions.program.parts import ALL, Asked, Branches, Form, MachineStates, Next, NodeFlow, inner_span
from rbxcompose.missions.program.program import CONTINUE, MissionNode, Program


@mission_check("RBX4136")
def nothing_to_keep(mission: Examined) -> Iterator[Finding]:
    """A node has no result to keep."""
    for node in mission.program.nodes:
        if node.saved and not node.step.has_result:
            message = f"'{node.step.word}' has no result to keep"
            yield nothing_to_keep.at(node.saved.span, message, help="skills, 'call', 'use' and 'for' have one")


@mission_check("RBX4164", Severity.WARNING, closed=(OWN,))
def read_too_early(mission: Examined) -> Iterator[Finding]:
    """A result is read before it is saved."""
    program = mission.program
    if any(interrupt.afterwards != CONTINUE for interrupt in program.interrupts):
        return  # what is restarted may read what an earlier run of it saved
    savers: dict[str, list[MissionNode]] = {}
    for node in program.nodes:
        if node.saved and node.saved.text not in program.data:
            savers.setdefault(node.saved.text, []).append(node)
    for node in program.nodes if savers else ():
        for asked in node.asked:
            for name in sorted({reference.name for reference in asked.expression.names} & savers.keys()):
                if all(_is_later(program, node, saver) for saver in savers[name]):
                    yield read_too_early.at(
                        asked.scalar.span,
                        f"nothing has saved '{name}' when this is read",
                        help="read it after the step that saves it, or give it a first value under 'data'",
                        related=[
                            Related(mission_node.saved.span, "saved here")
                            for mission_node in savers[name]
                            if mission_node.saved
                        ],
                    )


def _is_later(program: Program, reader: MissionNode, saver: MissionNode) -> bool:
    """Return whether a step surely begins after another one has ended, and neither comes again."""
    before, after = _above(program, reader), _above(program, saver)
    shared = [number for number in before if number in after]
    if not shared or reader.number in after or saver.number in before:
        return False  # in different reactions, or one is within the other
    around = program.nodes[shared[0]]
    if around.step.flow is not NodeFlow.IN_TURN or around.step.goes_on_after != "success":
        return False
    if any(program.nodes[number].comes_again for number in shared):
        return False
    return reader.number < saver.number


def _above(program: Program, node: MissionNode) -> list[int]:
    """Return the numbers of a node and all around it, from the inside out."""
    found, here = [node.number], node.parent
    while here is not None:
        found.append(here)
        here = program.nodes[here].parent
    return found


@mission_check("RBX4162")
def saved_over_datum(mission: Examined) -> Iterator[Finding]:
    """A result is kept in a datum of another type."""
    data = mission.program.data
    for node in mission.program.nodes:
        datum = data.get(node.saved.text) if node.saved and node.step.has_result else None
        if node.saved and datum and not accepts(datum.type, map_of(UNKNOWN)):
            name = node.saved.text
            yield saved_over_datum.at(
                node.saved.span,
                f"'{name}' is {datum.type.phrase}, but the result of '{node.step.word}' is a map",
                help=f"write '{name}: {{}}' under 'data', and read an entry of it as '${name}.NAME'; or save it under "
                "another name",
                related=[Related(datum.span, "the datum")],
            )


@mission_check("RBX4134", Severity.WARNING, closed=(OWN,))
def unwritten_output(mission: Examined) -> Iterator[Finding]:
    """An output that nothing writes."""
    program = mission.program
    constant = program.data.keys() - written(program)
    for name, asked in program.outputs.items():
        read = {reference.name for reference in asked.expression.names}
        if read and read <= constant:
            first = sorted(read)[0]
            yield unwritten_output.at(
                asked.scalar.span,
                f"the output '{name}' is always the same: nothing sets '{first}'",
                help=f"set '{first}' where its value is known, or keep a result with 'save: {first}'",
                related=[Related(program.data[first].span, "its only value")],
            )


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


ONE_WORD = "write 'next' as a map with 'success' and 'failure'"


@mission_check("RBX4141")
def open_outcome(mission: Examined) -> Iterator[Finding]:
    """An outcome of a state leads nowhere."""
    for node in mission.program.nodes:
        if node.step.look.form is Form.STATE:
            yield from _open(node, node.step.leads_to, mission.ending.of(node.number))


def _open(state: MissionNode, leads_to: Next | None, ends: Outcomes) -> Iterator[Finding]:
    if leads_to is None:
        if ends.words:
            message = f"the state '{state.name}' needs 'next': where it leads to"
            listed = " or ".join(f"'{word}'" for word in ends.words)
            yield open_outcome.at(state.span, message, help=f"it can end with {listed}")
    elif "" in leads_to.spans:
        if ends.counting_as(FAILS):
            message = f"the state '{state.name}' can fail, so one word after 'next' is not enough"
            yield open_outcome.at(leads_to.spans[""], message, help=ONE_WORD)
    else:
        meant = {OUTCOMES.get(key.lower()) for key in leads_to.keys.keys() - ends.words.keys()}  # told there
        for word, counts_as in ends.words.items():
            if word not in meant and leads_to.key_for(word, counts_as) is None:
                message = f"the state '{state.name}' can end with '{word}', which leads nowhere"
                yield open_outcome.at(state.span, message, help=f"write '{word}: ...' under 'next'")


@mission_check("RBX4133", Severity.WARNING, closed=(OWN,))
def trapped_state(mission: Examined) -> Iterator[Finding]:
    """A state from which no path leads to an end."""
    for machine, states, leads in transitions(mission.program):
        used = reached(machine.start, leads)
        goals = {*machine.ends, *(state.name for state in states if state.step.leads_to is None)}
        if not used & machine.ends.keys():
            continue  # it is meant to run for ever
        free = leading_to(goals, leads)
        for state in states:
            if state.name in used and state.name not in free:
                yield trapped_state.at(
                    state.span,
                    f"no path leads from the state '{state.name}' to an end",
                    help="let one of its outcomes, or of the states after it, lead back or to an end",
                )


@mission_check("RBX4142", is_fixable=True)
def unknown_outcome(mission: Examined) -> Iterator[Finding]:
    """A transition for an outcome that cannot occur."""
    for node in mission.program.nodes:
        leads_to = node.step.leads_to
        below = mission.program.below(node.number)
        if (
            leads_to is None
            or "" in leads_to.to
            or any(mission_node.skill not in ("", *mission.robot.skills) for mission_node in below)
        ):
            continue  # how a skill may end that the robot does not have is not known
        words, handled = mission.ending.of(node.number).words, leads_to.to
        counted = {counts_as for word, counts_as in words.items() if word not in handled}
        for outcome in leads_to.keys:
            if outcome not in words and outcome not in counted:
                message = f"the state '{node.name}' never ends with '{outcome}'"
                if (ours := OUTCOMES.get(outcome.lower())) in words and ours is not None and ours not in handled:
                    fix = replacement(leads_to.keys[outcome], outcome, ours, is_safe=False)
                    yield unknown_outcome.at(leads_to.keys[outcome], message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
                    continue
                yield unknown_outcome.misspelt(
                    leads_to.keys[outcome], message, outcome, words, "its outcomes", taken=handled
                )


@mission_check("RBX4140", is_fixable=True)
def unknown_state(mission: Examined) -> Iterator[Finding]:
    """A transition leads to a state that does not exist."""
    for node in mission.program.nodes:
        if node.step.states:
            yield from _start(node.step.states)
            for child in node.children:
                yield from _targets(mission.program.nodes[child], node.step.states)


def _start(machine: MachineStates) -> Iterator[Finding]:
    if machine.start_span and machine.names and machine.start not in machine.names:
        message, what = f"there is no state '{machine.start}'", "states of this machine"
        yield unknown_state.misspelt(machine.start_span, message, machine.start, machine.names, what)


def _targets(state: MissionNode, machine: MachineStates) -> Iterator[Finding]:
    leads_to = state.step.leads_to
    known = (*machine.names, *machine.ends)
    if leads_to is None:
        return
    for outcome, to in leads_to.to.items():
        if to not in known:
            message = f"there is no state or end '{to}'"
            yield unknown_state.misspelt(leads_to.spans[outcome], message, to, known, "states and ends")


@mission_check("RBX4143", Severity.WARNING, closed=(OWN,))
def unreachable_state(mission: Examined) -> Iterator[Finding]:
    """A state that cannot be reached."""
    for machine, states, leads in transitions(mission.program):
        used = reached(machine.start, leads)
        for state in states if machine.start in leads else ():
            if state.name not in used and state.name not in machine.ends:  # its name is the mistake
                yield unreachable_state.at(state.span, f"no path leads to the state '{state.name}'")
