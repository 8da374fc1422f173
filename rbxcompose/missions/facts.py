"""What a mission will do, as far as its text alone tells: constants, steps that cannot fail, steps that never end."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rbxcompose.config import Place
from rbxcompose.expressions.tree import (
    Arithmetic,
    Expression,
    ExpressionError,
    Field,
    Index,
    Number,
    Variable,
    Word,
    walk,
)
from rbxcompose.expressions.tree import Node as Tree
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions.deeds import written
from rbxcompose.missions.kinds.for_ import ForOptions
from rbxcompose.missions.program import Node, Program
from rbxcompose.missions.spans import expression_of

Constants = Mapping[str, Value]  # what `$names` stand for throughout


def constants_of(program: Program, inputs: Constants) -> dict[str, Value]:
    """Return the inputs, and the data that nothing changes."""
    changed = written(program)
    return {**{name: datum.value for name, datum in program.data.items() if name not in changed}, **inputs}


def number_of(expression: object, constants: Constants) -> float | None:
    """Return the number that an option of a node always gives, if it is an expression and that simple."""
    return number_in(expression.tree, constants) if isinstance(expression, Expression) else None


def number_in(tree: Tree, constants: Constants) -> float | None:
    """Return the number that a part of an expression always gives, if it is that simple."""
    match tree:
        case Number(value=value):
            return value
        case Variable(name=name):
            found = constants.get(name)
            return float(found) if isinstance(found, int | float) and not isinstance(found, bool) else None
    return None


def place_of(expression: Expression, constants: Constants, places: Mapping[str, Place]) -> Place | None:
    """Return the place that an expression always gives, if it is that simple."""
    match expression.tree:
        case Word(name=name):
            return places.get(name)
        case Variable(name=name):
            found = constants.get(name)
            return found if isinstance(found, Place) else places.get(str(found))
    return None


def goal_place(node: Node, main: str, constants: Constants, places: Mapping[str, Place]) -> Place | None:
    """Return the place that a skill's main argument always is, if it is that simple."""
    for argument in node.arguments:
        if argument.name in ("", main) and isinstance(argument.value, Scalar):
            try:
                return place_of(expression_of(argument.value), constants, places)
            except ExpressionError:
                return None
    return None


def items_of(node: Node, constants: Constants, places: Mapping[str, Place]) -> list[Place] | None:
    """Return the places that a loop goes through, if that is all it does and they are written down."""
    items = node.options.items if isinstance(node.options, ForOptions) else ()
    if isinstance(items, tuple):
        found = [place_of(item, constants, places) for item in items]
    else:
        listed = constants.get(items.tree.name) if isinstance(items.tree, Variable) else None
        found = [places.get(str(text)) for text in listed] if isinstance(listed, list | tuple) else [None]
    return [place for place in found if place] if all(found) else None


def starts_always(node: Node) -> bool:
    """Tell whether nothing can keep a node from starting."""
    return "only_if" not in node.modifiers


def never_skipped(program: Program, node: Node) -> bool:
    """Tell whether a node is always done, so that its result is success or failure."""
    if any(key in node.modifiers for key in ("only_if", "skip_if", "once", "cooldown")):
        return False
    if node.kind in _GROUPS:
        return any(never_skipped(program, program.nodes[child]) for child in node.children)
    return node.kind not in _MAY_DO_NOTHING


def never_fails(node: Node) -> bool:
    """Tell whether a node can only succeed, its modifiers left aside."""
    rule = _NEVER_FAILS.get(node.kind)
    return rule is not None and rule(node)


def _says_text(node: Node) -> bool:
    return not any(asked.expression.names for asked in node.asked)


def is_simple(node: Node) -> bool:
    """Tell whether the conditions of a node can always be asked."""
    # An item that is not there, or a division by zero, would be a failure.
    trees = (asked.expression.tree for asked in node.asked)
    return not any(isinstance(part, Index | Field | Arithmetic) for tree in trees for part, _ in walk(tree))


_GROUPS = ("sequence", "fallback", "parallel")  # skipped if all in them is
_MAY_DO_NOTHING = ("if", "choose", "for", "repeat", "machine", "use", "run")
_NEVER_FAILS: Mapping[str, Callable[[Node], bool]] = {
    "wait": lambda node: isinstance(node.options, Expression) and isinstance(node.options.tree, Number),
    "wait_for": is_simple,
    "log": _says_text,
}


def place_in_text(node: Node, expression: object) -> Span:
    """Return where an expression of a node stands."""
    return next((asked.scalar.span for asked in node.asked if asked.expression is expression), node.span)
