"""The value of an expression in a scope, and whether a condition holds; pure, and bounded by the size of the tree."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from operator import add, ge, gt, le, lt, mul, sub, truediv

from rbxcompose.expressions.functions import FUNCTIONS, items
from rbxcompose.expressions.tree import (
    Arithmetic,
    Call,
    Comparison,
    Expression,
    Field,
    Flag,
    Index,
    Items,
    Junction,
    Membership,
    Minus,
    Node,
    Not,
    Number,
    Text,
    Variable,
    Word,
)
from rbxcompose.expressions.values import (
    LONGEST_TEXT,
    MOST_IN_ALL,
    MOST_ITEMS,
    MOST_LEVELS,
    NOT_ARRIVED,
    EvaluationError,
    NotArrivedError,
    Place,
    Scope,
    Value,
    is_number,
    is_same,
)
from rbxcompose.units import MOST, format_number

_ORDERS: Mapping[str, Callable[[float, float], bool]] = {"<": lt, "<=": le, ">": gt, ">=": ge}
_OPERATIONS: Mapping[str, Callable[[float, float], float]] = {"+": add, "-": sub, "*": mul, "/": truediv}


def evaluate(expression: Expression, scope: Scope) -> Value:
    """Return the value of an expression: a float in SI, a flag, a text, a list, a map or something opaque.

    Raises:
        NotArrivedError: if it needs a value that has not arrived yet.
        EvaluationError: if it has no value otherwise, or one beyond the limits.
    """
    tree = expression.tree
    value = _value(tree, scope)
    if is_number(value):
        return _moderate(_number(value, tree), tree)
    return _limited_within(_limited(value, tree), tree)


def holds(expression: Expression, scope: Scope) -> bool:
    """Tell whether a condition holds, reading it from left to right until it is decided.

    One that comes upon a value which has not arrived yet does not hold, not even under `not`.

    Raises:
        EvaluationError: if it is neither true nor false.
    """
    try:
        return _flag(expression.tree, scope)
    except NotArrivedError:
        return False


def _value(node: Node, scope: Scope) -> Value:
    match node:
        case Variable(name=name):
            return _arrived(name, _known(scope.variable, name, f"${name}", node))
        case Number(value=value) | Text(value=value) | Flag(value=value):
            return value
        case Comparison():
            return _compared(node, scope)
        case Junction(operator=operator, operands=operands):
            wanted = operator == "or"
            return any(_flag(operand, scope) is wanted for operand in operands) is wanted
        case Not(operand=operand):
            return not _flag(operand, scope)
        case Word(name=name):
            return _known(scope.word, name, name, node)
        case Field() | Index():
            return _part(node, scope)
        case Call():
            return _called(node, scope)
        case Membership(item=item, group=group):
            sought = _value(item, scope)
            return any(is_same(sought, each) for each in _items(_value(group, scope), group))
        case Arithmetic():
            return _computed(node, scope)
        case Minus(operand=operand):
            return -_number(_value(operand, scope), operand)
        case Items(items=nodes):
            return [_value(item, scope) for item in nodes]


def _known(look_up: Callable[[str], Value], name: str, shown: str, node: Node) -> Value:
    try:
        return look_up(name)
    except KeyError:
        raise EvaluationError(f"unknown name '{shown}'", node.start, node.end) from None


def _arrived(name: str, value: Value) -> Value:
    if value is NOT_ARRIVED:
        raise NotArrivedError(name)
    return value


def _flag(node: Node, scope: Scope) -> bool:
    value = _value(node, scope)
    if not isinstance(value, bool):
        raise EvaluationError("this is neither true nor false", node.start, node.end)
    return value


def _number(value: Value, node: Node) -> float:
    # NaN compares as false whatever is asked, so that `not` would make it true.
    if isinstance(value, float) and value == value:
        return value
    if isinstance(value, int) and not isinstance(value, bool):
        return float(_moderate(value, node))
    raise EvaluationError("this is not a number", node.start, node.end)


def _moderate(value: float, node: Node) -> float:
    if not abs(value) < MOST:
        raise EvaluationError("the result is not finite or not below 1e15", node.start, node.end)
    return value


def _limited(value: Value, node: Node) -> Value:
    if isinstance(value, str) and len(value) > LONGEST_TEXT:
        raise EvaluationError(f"the text has more than {LONGEST_TEXT:,} characters", node.start, node.end)
    if isinstance(value, list | tuple | Mapping) and len(value) > MOST_ITEMS:
        raise EvaluationError(f"there are more than {MOST_ITEMS:,} items", node.start, node.end)
    return value


def _limited_within(value: Value, node: Node) -> Value:
    """Return a value; one that a mission makes larger with each round, such as `[$x, $x]`, comes to its end here."""
    level, left = [value], MOST_IN_ALL
    for _ in range(MOST_LEVELS):
        level = [item for group in level if not isinstance(group, float | str) for item in _inside(group)]
        left -= len(level)
        if left < 0:
            raise EvaluationError(f"there are more than {MOST_IN_ALL:,} items in all", node.start, node.end)
        if not level:
            return value
    raise EvaluationError(f"there are more than {MOST_LEVELS} levels of lists", node.start, node.end)


def _inside(value: Value) -> Collection[Value]:
    if isinstance(value, Mapping):
        return value.values()
    return value if isinstance(value, list | tuple) else ()


def _items(value: Value, node: Node) -> list[Value]:
    try:
        return items(value)
    except ValueError as error:
        raise EvaluationError(f"'in' {error}", node.start, node.end) from None


def _compared(node: Comparison, scope: Scope) -> bool:
    left, right = _value(node.left, scope), _value(node.right, scope)
    if order := _ORDERS.get(node.operator):
        return order(_number(left, node.left), _number(right, node.right))
    for value, operand in ((left, node.left), (right, node.right)):
        if isinstance(value, float) and value != value:
            raise EvaluationError("this is not a number", operand.start, operand.end)
    return is_same(left, right) is (node.operator == "==")


def _computed(node: Arithmetic, scope: Scope) -> Value:
    left, right = _value(node.left, scope), _value(node.right, scope)
    if node.operator == "+":
        if isinstance(left, str) and isinstance(right, str):
            return _limited(left + right, node)
        if isinstance(left, list | tuple) and isinstance(right, list | tuple):
            return _limited([*left, *right], node)
    one, other = _number(left, node.left), _number(right, node.right)
    if node.operator == "/" and other == 0:
        raise EvaluationError("division by zero", node.right.start, node.right.end)
    return _moderate(_OPERATIONS[node.operator](one, other), node)


def _part(node: Field | Index, scope: Scope) -> Value:
    whole = _value(node.of, scope)
    key = node.name if isinstance(node, Field) else _value(node.index, scope)
    if not isinstance(key, str) and isinstance(key, Place):
        key = key.name
    if isinstance(whole, Mapping):
        if isinstance(key, str) and key in whole:
            return whole[key]
        raise EvaluationError(f"there is no entry '{key}'", node.start, node.end)
    if isinstance(node, Field) or not isinstance(whole, list | tuple):
        raise EvaluationError("this has no entries", node.of.start, node.of.end)
    position = _number(key, node.index)
    if not (position.is_integer() and 0 <= position < len(whole)):
        message = f"there is no item {format_number(position)}: the list has {len(whole)}, counted from 0"
        raise EvaluationError(message, node.index.start, node.index.end)
    return whole[int(position)]


def _called(node: Call, scope: Scope) -> Value:
    function = FUNCTIONS[node.function]
    if wrong := function.wrong_count(len(node.arguments)):
        raise EvaluationError(f"{node.function}() {wrong}", node.start, node.end)
    if not function.compute:
        return _asked(node, scope)
    values = [_value(argument, scope) for argument in node.arguments]
    if node.function == "distance":
        values = [
            _known(scope.word, value, value, argument) if isinstance(value, str) else value
            for value, argument in zip(values, node.arguments, strict=True)
        ]
    try:
        return function.compute(*values)
    except ValueError as error:
        raise EvaluationError(f"{node.function}() {error}", node.start, node.end) from None


def _asked(node: Call, scope: Scope) -> Value:
    argument = node.arguments[0]
    if not isinstance(argument, Variable):
        raise EvaluationError(f"{node.function}() needs a name with '$'", argument.start, argument.end)
    ask = scope.age if node.function == "age" else scope.is_new
    return _arrived(argument.name, _known(ask, argument.name, f"${argument.name}", argument))
