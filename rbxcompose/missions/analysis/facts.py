"""What a mission will do, as far as its text shows: what it sets and sends, constants, what conditions give."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from rbxcompose.base.config import Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.tree import Comparison, ExpressionNode, Variable, Word
from rbxcompose.base.expressions.types import TypeKind
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Itself, Span, once
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.program.parts import Assignment, Deeds, MessageTemplate, Skipped, WrittenSetting, expression_of
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames, Skill


def assignments(node: MissionNode) -> Iterator[Assignment]:
    """Yield the assignments that a node makes."""
    yield from node.step.effects.assignments
    for deeds in _deeds(node):
        yield from deeds.assignments


def published(node: MissionNode) -> Iterator[MessageTemplate]:
    """Yield the messages that a node publishes."""
    if message := node.step.effects.published:
        yield message
    yield from (deeds.message for deeds in _deeds(node) if deeds.message)


def called(node: MissionNode) -> Iterator[MessageTemplate]:
    """Yield the request that a node makes."""
    if request := node.step.effects.called:
        yield request


def replaced(program: Program) -> frozenset[str]:
    """Return the names of all data that are assigned while a mission runs."""
    return program.saved.union(assignment.name for node in program.nodes for assignment in assignments(node))


def written(program: Program) -> frozenset[str]:
    """Return the names of all data that change while a mission runs, including those that only lose items."""
    return _written(Itself(program))


@once  # many rules ask
def _written(program: Itself[Program]) -> frozenset[str]:
    shortened = (node.step.effects.shortened for node in program.value.nodes)
    return replaced(program.value).union(name for name in shortened if name)


def sent_by(programs: Iterable[Program]) -> tuple[set[str], set[str]]:
    """Return the topics on which missions publish, and the services that they call, as they write them."""
    nodes = [node for program in programs for node in program.nodes]
    topics = {message.target.text for node in nodes for message in published(node)}
    services = {message.target.text for node in nodes for message in called(node)}
    return topics, services | {setting.service for setting in settings_of(nodes)}


def settings_of(nodes: Iterable[MissionNode]) -> list[WrittenSetting]:
    """Return the settings of components that nodes change."""
    return [setting for node in nodes if (setting := node.step.effects.setting) is not None]


def _deeds(node: MissionNode) -> Iterator[Deeds]:
    for modifier in node.modifiers.values():
        if modifier.moments:
            yield from modifier.moments.deeds.values()


Constants = Mapping[str, Value]  # values of `$names` that never change


def constants_of(program: Program, inputs: Constants) -> dict[str, Value]:
    """Return the inputs and the data that nothing changes."""
    changed = written(program)
    return {**{name: datum.value for name, datum in program.data.items() if name not in changed}, **inputs}


def shortened(program: Program) -> Constants:
    """Return the data that only ever lose items: what remains of them was there from the start."""
    names = (written(program) & program.data.keys()) - replaced(program)
    return {name: program.data[name].value for name in names}


def number_of(expression: syntax.Expression | None, constants: Constants) -> float | None:
    """Return the number that an option of a node always gives, if it is present and simple enough."""
    return number_in(expression.tree, constants) if expression else None


def number_in(tree: syntax.ExpressionNode, constants: Constants) -> float | None:
    """Return the number that a part of an expression always gives, if it is simple enough."""
    match tree:
        case syntax.Number(value=value):
            return value
        case syntax.Minus(operand=operand):
            inside = number_in(operand, constants)
            return None if inside is None else -inside
        case syntax.Variable(name=name):
            found = constants.get(name)
            return float(found) if isinstance(found, int | float) and not isinstance(found, bool) else None
    return None


def place_of(expression: syntax.Expression, constants: Constants, places: Mapping[str, Place]) -> Place | None:
    """Return the place that an expression always gives, if it is simple enough."""
    match expression.tree:
        case syntax.Word(name=name):
            return places.get(name)
        case syntax.Variable(name=name):
            found = constants.get(name)
            return found if isinstance(found, Place) else places.get(str(found))
    return None


def goal_place(node: MissionNode, main: str, constants: Constants, places: Mapping[str, Place]) -> Place | None:
    """Return the place that a skill's main argument always is, if it is simple enough."""
    for argument in node.step.arguments:
        if argument.name in ("", main) and isinstance(argument.value, ScalarNode):
            try:
                return place_of(expression_of(argument.value), constants, places)
            except syntax.ExpressionError:
                return None
    return None


def items_of(node: MissionNode, constants: Constants, places: Mapping[str, Place]) -> list[Place] | None:
    """Return the places that a loop iterates over, if it has only places and the text gives all of them."""
    items = node.step.items
    if items is None:
        return []
    if isinstance(items, tuple):
        found = [place_of(item, constants, places) for item in items]
    else:
        listed = constants.get(items.tree.name) if isinstance(items.tree, syntax.Variable) else None
        found = _known_places(listed, places) if isinstance(listed, list | tuple) else [None]
    return [place for place in found if place] if all(found) else None


def _known_places(listed: Iterable[Value], places: Mapping[str, Place]) -> list[Place | None]:
    """Return the places of a list, up to the first item that is none."""
    found: list[Place | None] = []
    for text in listed:
        found.append(places.get(str(text)))
        if found[-1] is None:
            break
    return found


def places_taken(program: Program, skills: Mapping[str, Skill]) -> Iterator[tuple[MissionNode, str, str]]:
    """Yield each node whose skill gets a place from a plain `$name`, that name, and the datum or input that has it.

    The item of a loop comes from what the loop iterates over. Missions that a mission uses are left out.
    """
    for node in program.nodes:
        skill = skills.get(node.skill)
        for argument in node.step.arguments if skill else ():
            wanted = skill.arguments.get(argument.name or skill.main) if skill else None
            if wanted is None or wanted.kind is not TypeKind.POSE or not isinstance(argument.value, ScalarNode):
                continue
            try:
                tree = expression_of(argument.value).tree
            except syntax.ExpressionError:
                continue
            if isinstance(tree, syntax.Variable) and (source := _source(program, node, tree.name)):
                yield node, tree.name, source


def _source(program: Program, node: MissionNode, name: str) -> str:
    """Return the datum or the input that `$name` comes from at a node; empty if that is not known."""
    found, above = name, node.parent
    while above is not None:
        around = program.nodes[above]
        if around.inner is not None:
            return ""
        if around.item == found == name:
            items = around.step.items
            tree = items.tree if isinstance(items, syntax.Expression) else None
            found = tree.name if isinstance(tree, syntax.Variable) else ""
        above = around.parent
    return found


def texts_in(value: Value) -> list[str]:
    """Return the texts that a datum has: itself, its items, or the names of its entries."""
    listed = value if isinstance(value, list | tuple | Mapping) else (value,)
    return [text for text in listed if isinstance(text, str)]


def never_skipped(program: Program, node: MissionNode) -> bool:
    """Return whether a node always runs, so that its result is success or failure."""
    if node.may_be_left_out:
        return False
    if node.step.skipped is Skipped.WITH_ALL_INSIDE:
        return any(never_skipped(program, program.nodes[child]) for child in node.children)
    return node.step.skipped is Skipped.NEVER


def is_simple(node: MissionNode) -> bool:
    """Return whether the conditions of a node can always be evaluated."""
    # A missing item or a division by zero would be a failure.
    trees = (asked.expression.tree for asked in node.asked)
    return not any(
        isinstance(part, syntax.Index | syntax.FieldAccess | syntax.Arithmetic)
        for tree in trees
        for part, _ in syntax.walk(tree)
    )


def is_sure(node: MissionNode, program: Program, robot: RobotNames) -> bool:
    """Return whether a node reads only what exists from the start, in ways that cannot fail."""
    read = {name.name for asked in node.asked for name in asked.expression.names}
    states = robot.values.keys() - robot.events  # a mission begins once they have arrived
    others = read - program.inputs.keys() - program.data.keys() - states
    if not others <= program.items:
        return False
    parts = (part for asked in node.asked for part, _ in syntax.walk(asked.expression.tree))
    return not any(isinstance(part, syntax.Index | syntax.FieldAccess) or _divides(part) for part in parts)


def _divides(part: syntax.ExpressionNode) -> bool:
    return isinstance(part, syntax.Arithmetic) and part.operator == "/"


def takes_time(pause: syntax.Expression | None) -> bool:
    """Return whether there is a duration that is not a literal zero."""
    return pause is not None and not (isinstance(pause.tree, syntax.Number) and pause.tree.value == 0)


def place_in_text(node: MissionNode, expression: syntax.Expression | None) -> Span:
    """Return the span of an expression of a node."""
    return next((asked.scalar.span for asked in node.asked if asked.expression is expression), node.span)


@dataclass(frozen=True, slots=True)
class Bounds:
    """The smallest and the largest possible value, both inclusive."""

    least: float = -math.inf
    most: float = math.inf


ANYTHING = Bounds()
NOT_BELOW_ZERO = Bounds(0.0)
Known = Mapping[str, Bounds]  # known bounds of `$names`

_TURNED = {"<": ">=", "<=": ">", ">": "<=", ">=": "<"}
_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}


def truth(node: syntax.ExpressionNode, known: Known) -> bool | None:
    """Return whether a condition always holds (True), never holds (False), or may do either (None)."""
    match node:
        case syntax.Flag(value=value):
            return value
        case syntax.Not(operand=operand):
            inner = truth(operand, known)
            return None if inner is None else not inner
        case syntax.Comparison(operator=operator, left=left, right=right):
            return _compared(operator, bounds_of(left, known), bounds_of(right, known))
        case syntax.Junction(operator=operator, operands=operands):
            return _joined(operands, known, decides=operator == "or")
    return None


def _compared(operator: str, left: Bounds, right: Bounds) -> bool | None:
    match operator:
        case "<":
            return True if left.most < right.least else False if left.least >= right.most else None
        case "<=":
            return True if left.most <= right.least else False if left.least > right.most else None
        case ">" | ">=":
            return _compared(_MIRRORED[operator], right, left)
    apart = left.most < right.least or right.most < left.least
    return None if not apart else operator == "!="


def _joined(operands: tuple[syntax.ExpressionNode, ...], known: Known, *, decides: bool) -> bool | None:
    """Evaluate from the left, as at run time: an operand counts only where those before it have not decided."""
    is_open = False
    for operand in operands:
        found = truth(operand, known)
        if found is decides:
            return decides
        is_open = is_open or found is None
        known = narrowed(known, operand, holds=not decides)
    return None if is_open else not decides


def narrowed(known: Known, node: syntax.ExpressionNode, *, holds: bool) -> Known:
    """Return the bounds that are known where a comparison of a `$name` holds, or does not hold."""
    if not isinstance(node, syntax.Comparison) or node.operator not in _TURNED:
        return known
    operator, name, limit = node.operator, node.left, bounds_of(node.right, known)
    if not isinstance(name, syntax.Variable):
        operator, name, limit = _MIRRORED[operator], node.right, bounds_of(node.left, known)
    if not isinstance(name, syntax.Variable):
        return known
    operator = operator if holds else _TURNED[operator]
    before = known.get(name.name, ANYTHING)
    if operator in ("<", "<="):
        return {**known, name.name: Bounds(before.least, min(before.most, limit.most))}
    return {**known, name.name: Bounds(max(before.least, limit.least), before.most)}


def bounds_of(node: syntax.ExpressionNode, known: Known) -> Bounds:
    """Return the bounds of a number; `ANYTHING` for everything else."""
    match node:
        case syntax.Number(value=value):
            return Bounds(value, value)
        case syntax.Variable(name=name):
            return known.get(name, ANYTHING)
        case syntax.Minus(operand=operand):
            inner = bounds_of(operand, known)
            return Bounds(-inner.most, -inner.least)
        case syntax.Arithmetic(operator=operator, left=left, right=right):
            return _computed(operator, bounds_of(left, known), bounds_of(right, known))
        case syntax.FunctionCall(function="distance" | "age" | "count" | "abs"):
            return NOT_BELOW_ZERO
    return ANYTHING


def _computed(operator: str, left: Bounds, right: Bounds) -> Bounds:
    match operator:
        case "+":
            return Bounds(left.least + right.least, left.most + right.most)
        case "-":
            return Bounds(left.least - right.most, left.most - right.least)
    ends = (left.least, left.most, right.least, right.most)
    if not all(map(math.isfinite, ends)) or (operator == "/" and right.least <= 0 <= right.most):
        return ANYTHING
    both = [(end, other) for end in ends[:2] for other in ends[2:]]
    found = [value * other if operator == "*" else value / other for value, other in both]
    return Bounds(min(found), max(found))


def compared_with_word(tree: ExpressionNode) -> tuple[str, Word] | None:
    """Return the `$name` and the word that a comparison tests for equality, None for anything else."""
    match tree:
        case Comparison(operator="==", left=Variable(name=name), right=Word() as word):
            return name, word
        case Comparison(operator="==", left=Word() as word, right=Variable(name=name)):
            return name, word
    return None
