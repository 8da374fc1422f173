"""Literal numbers in an expression, and suggestions where their unit does not fit."""

from __future__ import annotations

from rbxcompose.expressions.tree import ExpressionNode, Minus, Number, Variable
from rbxcompose.expressions.types import Type
from rbxcompose.units import DIMENSIONS, NUMBER, Dimension, bare_number_help, example, units_of


def _written(node: ExpressionNode) -> Number | None:
    """Return the literal number of a node; None if it is something else."""
    while isinstance(node, Minus):
        node = node.operand
    return node if isinstance(node, Number) else None


def is_bare(node: ExpressionNode) -> bool:
    """Return whether a node is a literal number without a unit."""
    number = _written(node)
    return number is not None and number.dimension == NUMBER


def missing_unit(node: ExpressionNode, dimension: Dimension) -> str:
    """Return what to write instead of a bare number, or nothing if it is read as SI."""
    sign = 1.0
    while isinstance(node, Minus):
        node, sign = node.operand, -sign
    return bare_number_help(dimension, sign * node.value) if isinstance(node, Number) else ""


def other_unit(left: tuple[ExpressionNode, Type], right: tuple[ExpressionNode, Type]) -> str:
    """Return the units of a literal quantity next to one that is not, or where a name gets its unit."""
    for (written, bare), (other, kind) in ((left, right), (right, left)):
        dimension = kind.dimension
        if dimension not in DIMENSIONS.values() or not dimension or _written(other):
            continue
        if _written(written):
            return f"units of {kind.phrase}: {', '.join(units_of(dimension)) or 'none'}"
        if isinstance(written, Variable) and bare.measure == NUMBER and dimension != NUMBER:
            return f"give '{written.name}' a unit where it is declared, such as '{example(dimension)}'"
    return ""


def quotes_needed(text: str) -> str:
    """Return the help for a text without quotes: those of the expression, within those of YAML."""
    return f"a text needs quotes: write '\"{text}\"'"
