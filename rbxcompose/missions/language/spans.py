"""From offsets in an expression to places in the manifest, and from scalars to expressions."""

from __future__ import annotations

from rbxcompose.expressions.parser import parse
from rbxcompose.expressions.tree import Expression, Flag, Number, Text, Word
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.units import NUMBER, Quantity


def inner_span(scalar: ScalarNode, start: int, end: int) -> Span:
    """Return the place of the characters `start` to `end` of a scalar.

    If the text in the file differs (folded lines, escapes, filled-in values), it is the whole scalar.
    """
    span = scalar.span
    quotes = 0 if scalar.plain else 1
    if span.line != span.end_line or span.end_column - span.column != len(scalar.text) + 2 * quotes:
        return span
    first = span.column + quotes + start
    return span._replace(column=first, end_column=max(first + 1, span.column + quotes + end))


def expression_of(scalar: ScalarNode) -> Expression:
    """Return the expression in a scalar; one filled in by `${...}` is a value already.

    Raises:
        ExpressionError: if it is no expression.
    """
    end = len(scalar.text)
    match scalar.filled:
        case None:
            return _parsed(scalar)
        case Quantity(value=value, dimension=dimension):
            return Expression(scalar.text, Number(0, end, value, dimension))
        case bool() as flag:
            return Expression(scalar.text, Flag(0, end, flag))
        case int() | float() as number:
            return Expression(scalar.text, Number(0, end, float(number), NUMBER))
        case text:
            return Expression(scalar.text, Text(0, end, str(text)))


def _parsed(scalar: ScalarNode) -> Expression:
    # Quotes round a whole word are intended: people write 'hello' for a text, and YAML removes the quotes.
    expression = parse(scalar.text)
    if not scalar.plain and isinstance(expression.tree, Word):
        return Expression(scalar.text, Text(0, len(scalar.text), expression.tree.name))
    return expression
