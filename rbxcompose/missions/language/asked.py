"""What is written in a node: expressions with their places and types, arguments, poses in place of names."""

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.tree import Expression, Flag, Number, Text, Word
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.findings import Span
from rbxcompose.base.units import NUMBER, Quantity
from rbxcompose.manifest.tree import ScalarNode, TreeNode


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
            # Quotes round a whole word are intended: people write 'hello' for a text, and YAML removes the quotes.
            expression = parse(scalar.text)
            if not scalar.plain and isinstance(expression.tree, Word):
                return Expression(scalar.text, Text(0, len(scalar.text), expression.tree.name))
            return expression
        case Quantity(value=value, dimension=dimension):
            return Expression(scalar.text, Number(0, end, value, dimension))
        case bool() as flag:
            return Expression(scalar.text, Flag(0, end, flag))
        case int() | float() as number:
            return Expression(scalar.text, Number(0, end, float(number), NUMBER))
        case text:
            return Expression(scalar.text, Text(0, end, str(text)))


@dataclass(frozen=True, slots=True)
class Asked:
    """An expression of a node, the type that its value must have, and the scalar that contains it.

    If its value is assigned, it must have the type of the datum. A watched condition is evaluated again and again while
    its node runs; all else is evaluated once.
    """

    expression: Expression
    wanted: Type
    scalar: ScalarNode
    is_assigned: bool = False
    is_watched: bool = False


@dataclass(frozen=True, slots=True)
class Assignment:
    """A name that is set, its place, and the expression for its new value."""

    name: str
    span: Span
    asked: Asked


@dataclass(frozen=True, slots=True)
class WrittenArgument:
    """An argument of a skill or a mission as written; its type depends on these. The main one has no name."""

    name: str
    value: TreeNode
    span: Span
