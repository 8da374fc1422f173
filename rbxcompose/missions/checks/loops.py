"""Loops and interrupts."""

from collections.abc import Iterator, Mapping

from rbxcompose.base.config import PLACE
from rbxcompose.base.expressions.check import check
from rbxcompose.base.expressions.tree import Expression, ExpressionNode, FieldAccess, Text, Variable, Word
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import OWN, Finding, Related, Severity, clauses, suggest
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.examined import Examined, View, mission_check
from rbxcompose.missions.analysis.facts import Constants, constants_of, replaced
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.program.outcomes import ANY, either
from rbxcompose.missions.program.program import END, MissionNode, Program

_MAY_BE = (TypeKind.PLACE, TypeKind.POSE, TypeKind.TEXT, TypeKind.UNKNOWN)  # a text may name a place


@mission_check("RBX4182")
def nearest_of_no_places(mission: Examined) -> Iterator[Finding]:
    """A loop takes the nearest item first, and an item is no place."""
    for view in mission.views:
        items = view.node.step.items
        if items is None or POSE not in view.node.step.reads:
            continue
        listed = (items,) if isinstance(items, Expression) else items
        for item, asked in zip(listed, view.node.asked, strict=False):
            found, _ = check(item, view.scope)
            if isinstance(items, Expression):
                yield from _in_list(view, items, found)
            elif found.kind not in _MAY_BE:
                yield nearest_of_no_places.at(asked.scalar.span, f"{_ASKED}, and this is {found.phrase}", help=_HELP)
            elif isinstance(item.tree, Text) and not _is_place(view, item.tree.value):
                message, help_text = _not_a_place(view, item.tree.value)
                yield nearest_of_no_places.at(asked.scalar.span, message, help=help_text, about=[item.tree.value])


_ASKED = "'order: nearest' needs places"
_HELP = "write 'order: written', or a list of places"


def _in_list(view: View, items: Expression, found: Type) -> Iterator[Finding]:
    """Yield the finding on a list that an expression gives: by its type, or by what is known of it."""
    span, data = view.node.asked[0].scalar.span, view.program.data
    if found.kind is TypeKind.LIST and found.entry.kind not in _MAY_BE:
        yield nearest_of_no_places.at(span, f"{_ASKED}, and each item is {found.entry.phrase}", help=_HELP)
    elif isinstance(items.tree, Variable) and (name := items.tree.name) in data.keys() - replaced(view.program):
        value: Value = data[name].value
        words = [item for item in value if isinstance(item, str)] if isinstance(value, list | tuple | Mapping) else []
        for word in words:
            if not _is_place(view, word):
                message, help_text = _not_a_place(view, word)
                related = [Related(data[name].span, "its items")]
                yield nearest_of_no_places.at(span, message, help=help_text, related=related, about=[word])
                return


def _is_place(view: View, word: str) -> bool:
    return word in view.robot.places or view.robot.may_have(PLACE, word)


def _not_a_place(view: View, word: str) -> tuple[str, str]:
    help_text = clauses(_HELP, suggest(word, view.robot.places, "places"))
    return f"{_ASKED}, and '{word}' is not a place", help_text


@mission_check("RBX4107", Severity.WARNING, closed=(OWN,))
def never_waits(mission: Examined) -> Iterator[Finding]:
    """An endless loop never waits."""
    for view in mission.views:
        node = view.node
        if view.waits:
            continue
        below = (one.step.ends_mission for one in mission.program.below(node.number))
        ends = either((mission.ending.of(node.number), *(ANY.of(result) for result in below if result)))
        for advice in (node.step.endless(ends), *(modifier.endless for modifier in node.modifiers.values())):
            if advice:
                yield never_waits.at(node.span, advice.message, help=advice.help)


@mission_check("RBX4183", Severity.WARNING, closed=())
def nothing_to_go_over(mission: Examined) -> Iterator[Finding]:
    """A loop goes over a list that is always empty."""
    program, changed = mission.program, replaced(mission.program)
    for node in program.nodes:
        items = node.step.items
        if isinstance(items, tuple) and not items and not node.asked:
            yield nothing_to_go_over.at(node.span, "its list is empty: nothing in it is ever done", help=_LIST_HELP)
        if items is None or isinstance(items, tuple):
            continue
        name, value = _start(
            items.tree, {key: datum.value for key, datum in program.data.items() if key not in changed}
        )
        if isinstance(value, list | tuple | Mapping) and not value:
            yield nothing_to_go_over.at(
                node.asked[0].scalar.span,
                f"'{items.text}' is empty, and no step of this mission fills it: nothing in this loop is ever done",
                help=f"write its items under 'data', or 'set: {{{name}: ...}}' in a step before it",
                related=[Related(program.data[name].span, "its only value")],
            )


_LIST_HELP = "write its items after 'in', such as 'in: [corner_1, corner_2]'"


def _start(tree: ExpressionNode, data: Mapping[str, Value]) -> tuple[str, Value]:
    """Return the datum that an expression reads and what the part of it is at the start; None if it is not known."""
    match tree:
        case Variable(name=name):
            return name, data.get(name)
        case FieldAccess(of=of, name=entry):
            name, whole = _start(of, data)
            return name, whole.get(entry) if isinstance(whole, Mapping) else None
    return "", None


@mission_check("RBX4137")
def nothing_to_shorten(mission: Examined) -> Iterator[Finding]:
    """`remove_done` without a list in the data."""
    for node in mission.program.nodes:
        shortened = node.step.effects.shortened
        items = node.step.items
        is_read = isinstance(items, tuple) or (items is not None and items.text)
        if shortened is not None and shortened not in mission.program.data and is_read and not mission.program.is_open:
            help_text = "write the list under 'data', and its name after 'in'"
            span = node.asked[0].scalar.span if node.asked else node.span
            yield nothing_to_shorten.at(span, "'remove_done' needs an 'in' that names data", help=help_text)


@mission_check("RBX4187", Severity.WARNING, closed=(OWN,))
def unread_item(mission: Examined) -> Iterator[Finding]:
    """A loop never reads its item."""
    program = mission.program
    known = constants_of(program, {})
    for node in program.nodes:
        if node.step.items is None or node.item in program.reads:
            continue
        items = _words(node, known)
        for scalar in _written(program, node):
            if scalar.text in items:
                yield unread_item.at(
                    scalar.span,
                    f"each round takes '{scalar.text}': nothing in this loop reads '${node.item}'",
                    help=f"write '${node.item}'",
                    related=[Related(node.span, "the loop")],
                )
                break


def _words(node: MissionNode, known: Constants) -> set[str]:
    """Return the items of a loop that are words, as far as the text shows them."""
    items = node.step.items
    if isinstance(items, Expression):
        listed = known.get(items.tree.name) if isinstance(items.tree, Variable) else None
        return {item for item in listed if isinstance(item, str)} if isinstance(listed, list | tuple) else set()
    return {item.tree.name for item in items or () if isinstance(item.tree, Word)}


def _written(program: Program, loop: MissionNode) -> Iterator[ScalarNode]:
    """Yield the values that steps inside of a loop give to skills and missions."""
    for node in program.nodes[loop.number + 1 : loop.end]:
        yield from (argument.value for argument in node.step.arguments if isinstance(argument.value, ScalarNode))


@mission_check("RBX4116", Severity.WARNING, closed=(OWN,))
def not_restartable(mission: Examined) -> Iterator[Finding]:
    """An interrupt may restart a skill that cannot be restarted."""
    cutting = [interrupt for interrupt in mission.program.interrupts if interrupt.afterwards != END]
    for node in mission.program.below(mission.program.main) if cutting else ():
        skill = mission.robot.skills.get(node.skill)
        if skill and not skill.restartable and not skill.pausable:
            related = [Related(cutting[0].span, "this may cut it short")]
            afterwards = cutting[0].afterwards
            message = f"the skill '{skill.name}' cannot be restarted, but 'afterwards: {afterwards}' would do so"
            yield not_restartable.at(node.span, message, related=related)


@mission_check("RBX4171", Severity.WARNING, closed=())
def same_interrupt(mission: Examined) -> Iterator[Finding]:
    """Two interrupts have the same condition."""
    first: dict[str, int] = {}
    interrupts = mission.program.interrupts
    for index, interrupt in enumerate(interrupts):
        other = interrupts[first.setdefault(interrupt.when.expression.text, index)]
        if other is not interrupt:
            yield same_interrupt.at(
                interrupt.when.scalar.span,
                f"'{interrupt.name}' has the condition of '{other.name}'",
                help="change the condition, or put both reactions into one",
                related=[Related(other.when.scalar.span, "the first one")],
            )


@mission_check("RBX4145", is_fixable=True)
def unknown_target(mission: Examined) -> Iterator[Finding]:
    """An interrupt restarts something that does not exist."""
    known = {name for node in mission.program.nodes for name in (node.name, node.item) if name}
    for interrupt in mission.program.interrupts:
        named = interrupt.restarts
        if named and not interrupt.targets and not mission.program.is_open:
            message = f"nothing in the mission is named '{named.text}'"
            yield unknown_target.misspelt(named.span, message, named.text, known, "names of the mission")
