"""What is known about a condition before it is evaluated: whether it holds always, never, or sometimes."""

import math
from collections.abc import Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree


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


def truth(node: tree.ExpressionNode, known: Known) -> bool | None:
    """Return whether a condition always holds (True), never holds (False), or may do either (None)."""
    match node:
        case tree.Flag(value=value):
            return value
        case tree.Not(operand=operand):
            inner = truth(operand, known)
            return None if inner is None else not inner
        case tree.Comparison(operator=operator, left=left, right=right):
            return _compared(operator, bounds_of(left, known), bounds_of(right, known))
        case tree.Junction(operator=operator, operands=operands):
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


def _joined(operands: tuple[tree.ExpressionNode, ...], known: Known, *, decides: bool) -> bool | None:
    """Evaluate from the left, as at run time: an operand counts only where those before it have not decided."""
    is_open = False
    for operand in operands:
        found = truth(operand, known)
        if found is decides:
            return decides
        is_open = is_open or found is None
        known = narrowed(known, operand, holds=not decides)
    return None if is_open else not decides


def narrowed(known: Known, node: tree.ExpressionNode, *, holds: bool) -> Known:
    """Return the bounds that are known where a comparison of a `$name` holds, or does not hold."""
    if not isinstance(node, tree.Comparison) or node.operator not in _TURNED:
        return known
    operator, name, limit = node.operator, node.left, bounds_of(node.right, known)
    if not isinstance(name, tree.Variable):
        operator, name, limit = _MIRRORED[operator], node.right, bounds_of(node.left, known)
    if not isinstance(name, tree.Variable):
        return known
    operator = operator if holds else _TURNED[operator]
    before = known.get(name.name, ANYTHING)
    if operator in ("<", "<="):
        return {**known, name.name: Bounds(before.least, min(before.most, limit.most))}
    return {**known, name.name: Bounds(max(before.least, limit.least), before.most)}


def bounds_of(node: tree.ExpressionNode, known: Known) -> Bounds:
    """Return the bounds of a number; `ANYTHING` for everything else."""
    match node:
        case tree.Number(value=value):
            return Bounds(value, value)
        case tree.Variable(name=name):
            return known.get(name, ANYTHING)
        case tree.Minus(operand=operand):
            inner = bounds_of(operand, known)
            return Bounds(-inner.most, -inner.least)
        case tree.Arithmetic(operator=operator, left=left, right=right):
            return _computed(operator, bounds_of(left, known), bounds_of(right, known))
        case tree.FunctionCall(function="distance" | "age" | "count" | "abs"):
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
