"""What a mission will do, as far as its text shows: constants, steps that cannot fail, steps that never end."""

from collections.abc import Iterable, Iterator, Mapping

from rbxcompose.base.config import Place
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.types import TypeKind
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.effects import replaced, written
from rbxcompose.missions.language.asked import expression_of
from rbxcompose.missions.program.answers import Skipped
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames, Skill

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
