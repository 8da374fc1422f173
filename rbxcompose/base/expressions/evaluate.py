"""Evaluate expressions and conditions in a scope; pure, and bounded by the size of the tree.

A tree becomes a function of the scope at its first use: missions evaluate the same conditions again and again.
"""

from collections.abc import Callable, Collection, Mapping
from operator import add, ge, gt, le, lt, mul, sub, truediv
from typing import TypeAlias

from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.values import (
    FUNCTIONS,
    LONGEST_TEXT,
    MOST_IN_ALL,
    MOST_ITEMS,
    MOST_LEVELS,
    NOT_ARRIVED,
    EvaluationError,
    NotArrivedError,
    Scope,
    Value,
    is_named_pose,
    is_number,
    is_same,
    items,
)
from rbxcompose.base.units import MOST, format_number

Evaluate: TypeAlias = Callable[[Scope], Value]
Predicate: TypeAlias = Callable[[Scope], bool]
Measure: TypeAlias = Callable[[Scope], float]

_ORDERS: Mapping[str, Callable[[float, float], bool]] = {"<": lt, "<=": le, ">": gt, ">=": ge}
_OPERATIONS: Mapping[str, Callable[[float, float], float]] = {"+": add, "-": sub, "*": mul, "/": truediv}


def evaluate(expression: syntax.Expression, scope: Scope) -> Value:
    """Return the value of an expression: a float in SI, a flag, a text, a list, a map or something opaque.

    Raises:
        NotArrivedError: if it needs a value that has not arrived yet.
        EvaluationError: if it has no value for another reason, or one beyond the limits.
    """
    tree = expression.tree
    run = expression.made.get("run")
    if run is None:
        run = expression.made["run"] = _run(tree)
    value = run(scope)
    if is_number(value):
        return _moderate(_number(value, tree), tree)
    return _limited_within(_limited(value, tree), tree)


def holds(expression: syntax.Expression, scope: Scope) -> bool:
    """Return whether a condition holds, evaluating it from left to right until it is decided.

    A condition that reaches a value that has not arrived yet does not hold, not even under `not`.

    Raises:
        EvaluationError: if it is neither true nor false.
    """
    ask = expression.made.get("ask")
    if ask is None:
        ask = expression.made["ask"] = _ask(expression.tree)
    try:
        return bool(ask(scope))
    except NotArrivedError:
        return False


def _run(node: syntax.ExpressionNode) -> Evaluate:
    """Return a function that computes the value of a part of an expression."""
    match node:
        case syntax.Variable():
            return _variable(node)
        case syntax.Number(value=value) | syntax.Text(value=value):
            return lambda scope: value
        case syntax.Flag() | syntax.Comparison() | syntax.Junction() | syntax.Not() | syntax.Membership():
            return _ask(node)
        case syntax.Word(name=name):
            return lambda scope: _known(scope.word, name, name, node)
        case syntax.FieldAccess() | syntax.Index():
            return _part(node)
        case syntax.FunctionCall():
            return _called(node)
        case syntax.Arithmetic():
            return _computed(node)
        case syntax.Minus(operand=operand):
            measure = _measure(operand)
            return lambda scope: -measure(scope)
        case syntax.Items(items=nodes):
            runs = [_run(item) for item in nodes]
            return lambda scope: [run(scope) for run in runs]


def _ask(node: syntax.ExpressionNode) -> Predicate:
    """Return a function that evaluates a part of an expression that must be true or false."""
    match node:
        case syntax.Flag(value=flag):
            return lambda scope: flag
        case syntax.Comparison():
            return _compared(node)
        case syntax.Junction(operator=operator, operands=operands):
            wanted, asks = operator == "or", [_ask(operand) for operand in operands]
            return lambda scope: any(ask(scope) is wanted for ask in asks) is wanted
        case syntax.Not(operand=operand):
            inner = _ask(operand)
            return lambda scope: not inner(scope)
        case syntax.Membership(item=item, group=group):
            sought, among = _run(item), _run(group)
            return lambda scope: _is_among(sought(scope), _items(among(scope), group))
    run = _run(node)

    def ask(scope: Scope) -> bool:
        value = run(scope)
        if not isinstance(value, bool):
            raise EvaluationError("this is neither true nor false", node.start, node.end)
        return value

    return ask


def _is_among(sought: Value, group: list[Value]) -> bool:
    return any(is_same(sought, each) for each in group)


def _measure(node: syntax.ExpressionNode) -> Measure:
    """Return a function that computes a part of an expression that must be a number."""
    if isinstance(node, syntax.Number):
        number = node.value
        return lambda scope: number
    run = _run(node)

    def measure(scope: Scope) -> float:
        value = run(scope)
        # Every comparison with NaN is false, so `not` would make it true.
        return value if type(value) is float and value == value else _number(value, node)

    return measure


def _variable(node: syntax.Variable) -> Evaluate:
    name = node.name

    def run(scope: Scope) -> Value:
        try:
            value = scope.variable(name)
        except KeyError:
            raise EvaluationError(f"unknown name '${name}'", node.start, node.end) from None
        if value is NOT_ARRIVED:
            raise NotArrivedError(name)
        return value

    return run


def _known(look_up: Callable[[str], Value], name: str, shown: str, node: syntax.ExpressionNode) -> Value:
    try:
        return look_up(name)
    except KeyError:
        raise EvaluationError(f"unknown name '{shown}'", node.start, node.end) from None


def _number(value: Value, node: syntax.ExpressionNode) -> float:
    # Every comparison with NaN is false, so `not` would make it true.
    if isinstance(value, float) and value == value:
        return value
    if isinstance(value, int) and not isinstance(value, bool):
        return float(_moderate(value, node))
    raise EvaluationError("this is not a number", node.start, node.end)


def _moderate(value: float, node: syntax.ExpressionNode) -> float:
    if not abs(value) < MOST:
        raise EvaluationError("the result is not finite or not below 1e15", node.start, node.end)
    return value


def _limited(value: Value, node: syntax.ExpressionNode) -> Value:
    if isinstance(value, str) and len(value) > LONGEST_TEXT:
        raise EvaluationError(f"the text has more than {LONGEST_TEXT:,} characters", node.start, node.end)
    if isinstance(value, list | tuple | Mapping) and len(value) > MOST_ITEMS:
        raise EvaluationError(f"there are more than {MOST_ITEMS:,} items", node.start, node.end)
    return value


def _limited_within(value: Value, node: syntax.ExpressionNode) -> Value:
    """Return a value within the limits; this stops one that a mission grows in each round, such as `[$x, $x]`."""
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


def _items(value: Value, node: syntax.ExpressionNode) -> list[Value]:
    try:
        return items(value)
    except ValueError as error:
        raise EvaluationError(f"'in' {error}", node.start, node.end) from None


def _compared(node: syntax.Comparison) -> Predicate:
    if order := _ORDERS.get(node.operator):
        measure, other = _measure(node.left), _measure(node.right)
        return lambda scope: order(measure(scope), other(scope))
    left, right, is_equal = _run(node.left), _run(node.right), node.operator == "=="

    def ask(scope: Scope) -> bool:
        values = left(scope), right(scope)
        for value, operand in zip(values, (node.left, node.right), strict=True):
            if isinstance(value, float) and value != value:
                raise EvaluationError("this is not a number", operand.start, operand.end)
        return is_same(*values) is is_equal

    return ask


def _computed(node: syntax.Arithmetic) -> Evaluate:
    left, right, operation = _run(node.left), _run(node.right), _OPERATIONS[node.operator]

    def run(scope: Scope) -> Value:
        one, other = left(scope), right(scope)
        if node.operator == "+":
            if isinstance(one, str) and isinstance(other, str):
                return _limited(one + other, node)
            if isinstance(one, list | tuple) and isinstance(other, list | tuple):
                return _limited([*one, *other], node)
        first, second = _number(one, node.left), _number(other, node.right)
        if node.operator == "/" and second == 0:
            raise EvaluationError("division by zero", node.right.start, node.right.end)
        return _moderate(operation(first, second), node)

    return run


def _part(node: syntax.FieldAccess | syntax.Index) -> Evaluate:
    of = _run(node.of)
    if isinstance(node, syntax.FieldAccess):
        name = node.name
        return lambda scope: _entry(of(scope), name, node)
    index = _run(node.index)
    return lambda scope: _entry(of(scope), index(scope), node)


def _entry(whole: Value, key: Value, node: syntax.FieldAccess | syntax.Index) -> Value:
    if not isinstance(key, str) and is_named_pose(key):
        key = key.name
    if isinstance(whole, Mapping):
        if isinstance(key, str) and key in whole:
            return whole[key]
        raise EvaluationError(f"there is no entry '{key}'", node.start, node.end)
    if isinstance(node, syntax.FieldAccess) or not isinstance(whole, list | tuple):
        raise EvaluationError("this has no entries", node.of.start, node.of.end)
    position = _number(key, node.index)
    if not (position.is_integer() and 0 <= position < len(whole)):
        message = f"there is no item {format_number(position)}: the list has {len(whole)}, counted from 0"
        raise EvaluationError(message, node.index.start, node.index.end)
    return whole[int(position)]


def _called(node: syntax.FunctionCall) -> Evaluate:
    function, name = FUNCTIONS[node.function], node.function
    compute, wrong = function.compute, function.wrong_count(len(node.arguments))
    if compute is None or wrong:
        return lambda scope: _asked(node, scope, wrong)
    runs = [_run(argument) for argument in node.arguments]

    def run(scope: Scope) -> Value:
        values = [run(scope) for run in runs]
        if name == "distance":
            values = [
                _known(scope.word, value, value, argument) if isinstance(value, str) else value
                for value, argument in zip(values, node.arguments, strict=True)
            ]
        try:
            return compute(*values)
        except ValueError as error:
            raise EvaluationError(f"{name}() {error}", node.start, node.end) from None

    return run


def _asked(node: syntax.FunctionCall, scope: Scope, wrong: str) -> Value:
    """Return what only the scope knows about a `$name`."""
    if wrong:
        raise EvaluationError(f"{node.function}() {wrong}", node.start, node.end)
    argument = node.arguments[0]
    if not isinstance(argument, syntax.Variable):
        raise EvaluationError(f"{node.function}() needs a name with '$'", argument.start, argument.end)
    ask = scope.age if node.function == "age" else scope.is_new
    value = _known(ask, argument.name, f"${argument.name}", argument)
    if value is NOT_ARRIVED:
        raise NotArrivedError(argument.name)
    return value
