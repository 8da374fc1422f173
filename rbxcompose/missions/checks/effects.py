"""Steps, conditions, modifiers and numbers without effect."""

from collections.abc import Iterator
from itertools import pairwise

from rbxcompose.base.expressions.tree import Junction, Not
from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.findings import OWN, Finding, Related, Severity, Span
from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis import facts
from rbxcompose.missions.analysis.examined import Ending, Examined, mission_check
from rbxcompose.missions.analysis.facts import Constants
from rbxcompose.missions.program.outcomes import FAILS, SUCCEEDS
from rbxcompose.missions.program.parts import Asked, ModifierScope, NodeFlow
from rbxcompose.missions.program.program import CONTINUE, MissionNode, Program


@mission_check("RBX4125", Severity.WARNING, closed=(OWN,))
def after_forever(mission: Examined) -> Iterator[Finding]:
    """A step is never reached."""
    for node in mission.program.nodes:
        if found := _barrier(mission.program, node, mission.ending):
            barrier, following, why, cure = found
            if mistaken := _endless_branch(barrier, mission.ending):
                yield after_forever.at(
                    mistaken,
                    f"this branch {why}, so the step after it is never reached",
                    help="name the branch that ends",
                    related=[Related(following.span, "the step")],
                )
                continue
            yield after_forever.at(
                following.span,
                f"this step is never reached: the one before it {why}",
                help=cure,
                related=[Related(barrier.span, "this one")],
            )


def _endless_branch(barrier: MissionNode, ending: Ending) -> Span | None:
    """Return where a parallel is told to end with a branch that never does, beside others that do."""
    branches = barrier.step.branches
    if branches is None or not branches.ends_with:
        return None
    ends = ending.of_branches(barrier)
    others = [end.counting_as(SUCCEEDS) for name, end in ends.items() if name != branches.ends_with]
    return branches.ends_at if any(others) else None


def _barrier(program: Program, node: MissionNode, ending: Ending) -> tuple[MissionNode, MissionNode, str, str] | None:
    """Return the first step after which none can run, the next step, and why."""
    steps = [program.nodes[child] for child in node.children]
    for step, following in pairwise(steps) if node.step.goes_on_after else ():
        if ending.of(step.number).counting_as(node.step.goes_on_after):
            continue
        if node.step.goes_on_after == SUCCEEDS:
            return step, following, "never ends in success", "put this one before it, or let that one end in success"
        if facts.never_skipped(program, step):
            return step, following, "never fails", "put this one before it: a fallback goes on after a failure"
    return None


_ASKED_FIRST = ("only_if", "as_long_as")


@mission_check("RBX4169", Severity.WARNING)
def contrary_conditions(mission: Examined) -> Iterator[Finding]:
    """A step has two conditions that never hold together."""
    program = mission.program
    for node in program.nodes:
        only, skip = _condition(node, "only_if"), _condition(node, "skip_if")
        if only and skip and not _go_together(only, skip, is_second=False):
            yield _finding(skip.scalar, only.scalar, "'skip_if' holds whenever 'only_if' does: this step never runs")
    for interrupt in program.interrupts:
        for node in _first_steps(program, interrupt.root):
            for key in _ASKED_FIRST:
                asked, when = _condition(node, key), interrupt.when
                if asked and not _go_together(when, asked, is_second=True):
                    message = f"'{key}' does not hold when '{interrupt.name}' begins, so this step does nothing"
                    yield _finding(asked.scalar, when.scalar, message)


def _finding(at: ScalarNode, other: ScalarNode, message: str) -> Finding:
    return contrary_conditions.at(at.span, message, help="remove one", related=[Related(other.span, "the other one")])


def _condition(node: MissionNode, key: str) -> Asked | None:
    wanted = node.modifiers[key].value if key in node.modifiers else None
    found = [one for one in node.asked[node.own :] if one.expression is wanted and wanted is not None]
    return found[list(node.modifiers).index(key) > 0 and -1] if found else None  # of equal ones, the first or the last


def _go_together(first: Asked, second: Asked, *, is_second: bool) -> bool:
    """Return whether the first may hold while the second does, or does not."""
    node, other = first.expression.tree, second.expression.tree
    if facts.truth(other, {}) is not None:
        return True  # it is decided by itself, as when somebody tries something out
    both = Junction(node.start, node.end, "and", (node, other if is_second else Not(other.start, other.end, other)))
    return facts.truth(both, {}) is not False and (is_second or first.expression.text != second.expression.text)


def _first_steps(program: Program, number: int | None) -> Iterator[MissionNode]:
    """Yield a node and those inside that begin with it, unless another one may begin first."""
    while number is not None:
        node = program.nodes[number]
        yield node
        number = node.children[0] if node.step.flow is NodeFlow.IN_TURN and node.children else None


@mission_check("RBX4180")
def event_at_once(mission: Examined) -> Iterator[Finding]:
    """A condition on an event is evaluated only once."""
    program = mission.program
    events = mission.robot.events - {*program.data, *program.inputs}
    for node in program.nodes if events else ():
        for asked in node.asked:
            if asked.wanted == FLAG and not asked.is_watched and not asked.is_assigned:
                for name in sorted({name.name for name in asked.expression.names} & events):
                    message = f"nothing of '${name}' can have come since this node began: it asks at that moment"
                    yield event_at_once.at(asked.scalar.span, message, help="wait for it: 'wait_for', with a 'timeout'")


@mission_check("RBX4170", Severity.WARNING, closed=())
def frozen_condition(mission: Examined) -> Iterator[Finding]:
    """A condition is waited for that nothing changes."""
    program = mission.program
    fixed = program.data.keys() - facts.written(program)
    for node in program.nodes if fixed else ():
        for asked in node.asked[: node.own]:
            names = {name.name for name in asked.expression.names}
            if asked.is_watched and asked.wanted == FLAG and names and names <= fixed:
                name = sorted(names)[0]
                yield frozen_condition.at(
                    asked.scalar.span,
                    f"no step of this mission sets '${name}', so this never changes",
                    help=f"write 'set: {{{name}: ...}}' where it changes",
                    related=[Related(program.data[name].span, "its only value")],
                )


@mission_check("RBX4127", Severity.WARNING, closed=(OWN,))
def idle_modifier(mission: Examined) -> Iterator[Finding]:
    """A modifier changes nothing."""
    known = facts.constants_of(mission.program, {})
    for node in mission.program.nodes:
        yield from _attempt(node, known)
        yield from _forgiven(mission, node)
        for key, modifier in node.modifiers.items():
            if modifier.serves is ModifierScope.FAILING and not mission.ending.inside_of(node, key).counting_as(FAILS):
                yield idle_modifier.at(
                    facts.place_in_text(node, modifier.value),
                    f"'{key}' changes nothing here: '{node.step.word}' cannot fail",
                    help="it belongs to the step that can fail",
                )
            if modifier.serves is ModifierScope.REPEATED and not _comes_again(mission.program, node):
                yield idle_modifier.at(
                    node.span,
                    f"'{key}' changes nothing here: this step is done only once anyway",
                    help="it belongs to a step inside a loop or a machine",
                )


def _attempt(node: MissionNode, known: Constants) -> Iterator[Finding]:
    """Yield the finding about a limit of each attempt that the limit of all forestalls."""
    each = node.attempt_limit
    value, whole = facts.number_of(each, known), facts.number_of(node.limit, known)
    if each is not None and value is not None and whole is not None and value >= whole:
        yield idle_modifier.at(
            facts.place_in_text(node, each),
            f"'attempt_timeout' changes nothing here: all attempts together end after {format_quantity(whole, TIME)}",
            help="'timeout' counts all attempts: make it longer than 'attempt_timeout' times 'attempts'",
        )


def _forgiven(mission: Examined, node: MissionNode) -> Iterator[Finding]:
    """Yield the finding about a condition whose answer nothing takes."""
    is_question = node.step.only_asks and not node.step.waits
    if not is_question or any(one.moments or one.saved for one in node.modifiers.values()):
        return
    for key, modifier in node.modifiers.items():
        turned = mission.ending.inside_of(node, key)
        if modifier.forgives and turned.counting_as(FAILS) and not modifier.changed(turned).counting_as(FAILS):
            yield idle_modifier.at(
                node.span,
                f"'{node.step.word}' decides nothing here: with '{key}', the mission goes on whatever the answer is",
                help=f"remove '{key}', or write 'if' with the steps that it guards below 'then'",
            )


def _comes_again(program: Program, node: MissionNode) -> bool:
    """Return whether anything in the mission can start a node a second time."""
    if any(interrupt.afterwards != CONTINUE for interrupt in program.interrupts):
        return True
    parent = node.parent
    if parent is None:
        return node.number != program.main  # a reaction runs as often as its interrupt
    above = program.nodes[parent]
    return above.comes_again or _comes_again(program, above)


@mission_check("RBX4128", Severity.WARNING, closed=())
def pointless_number(mission: Examined) -> Iterator[Finding]:
    """A number of rounds or attempts, or a duration, leaves nothing to be done."""
    for node in mission.program.nodes:
        modifiers = (number for modifier in node.modifiers.values() for number in modifier.numbers)
        for what, expression, least, effect in (*node.step.numbers, *modifiers):
            written = expression if expression and expression.text else None
            value = facts.number_of(written, {})  # without the data: a name may be on purpose
            if expression and value is not None and 0 <= value < least:
                yield pointless_number.at(
                    facts.place_in_text(node, expression),
                    f"{what} {effect or 'must be above zero to have an effect'}",
                    help="write a larger number, or leave it out",
                )
