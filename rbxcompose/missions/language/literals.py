"""Literal values in a manifest, and whether the value of a typed argument or input can be of that type."""

from collections.abc import Iterator

from rbxcompose.base.expressions.text import TextSlot, parse_template, refuse_foreign
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.expressions.types import (
    COUNT,
    FLAG,
    TEXT,
    UNKNOWN,
    Type,
    TypeKind,
    accepts,
    list_with,
    map_with,
    quantity_of,
)
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import DID_YOU_MEAN, Finding, FindingKind, surely_meant
from rbxcompose.base.units import NUMBER, Quantity, UnitError, parse_quantity, to_si
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode, describe, plain_value
from rbxcompose.missions import codes
from rbxcompose.missions.analysis.scope_types import View
from rbxcompose.missions.language.asked import expression_of, inner_span
from rbxcompose.missions.program.machines import Datum


def check_written(view: View, scalar: ScalarNode, wanted: Type, kind: FindingKind) -> Iterator[Finding]:
    """Yield the findings on a value that must have a type; a wrong type is a finding of the given kind."""
    try:
        if wanted.kind is not TypeKind.TEXT:
            yield from view.typed(expression_of(scalar), wanted, scalar, kind)
            return
        refuse_foreign(scalar.text)
        for slot in parse_template(scalar.text).parts:
            if isinstance(slot, TextSlot):
                part = ScalarNode(slot.value.text, inner_span(scalar, slot.start, slot.end))
                yield from view.typed(slot.value, UNKNOWN, part, kind)
    except ExpressionError as error:
        yield codes.NO_EXPRESSION.at(inner_span(scalar, error.start, error.end), error.message, help=error.help)


class WrongValue(ValueError):  # noqa: N818 - a user's mistake, told apart from errors of ours
    """Raised when a value does not have its type; `label` says what it is instead, `help` what to do."""

    def __init__(self, message: str, *, label: str = "", help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.label = label
        self.help = help


def literal(node: TreeNode) -> Datum:
    """Return the literal in a node: a number in SI, a flag, a text, a list or a map of these."""
    match node:
        case MappingNode(entries=entries):
            values = {name: literal(entry.value) for name, entry in entries.items()}
            found = map_with({name: datum.type for name, datum in values.items()})
            return Datum({name: datum.value for name, datum in values.items()}, found, node.span)
        case SequenceNode(items=items):
            read = [literal(item) for item in items]
            return Datum([datum.value for datum in read], list_with([datum.type for datum in read]), node.span)
        case ScalarNode():
            value = node.filled if node.filled is not None else _measured(node)
            return Datum(*_typed(value), node.span)


def typed(node: TreeNode, wanted: Type) -> Datum:
    """Return the literal in a node as a value of the type `wanted`; places stay texts.

    Raises:
        WrongValue: if it does not have that type.
    """
    if wanted.kind in (TypeKind.LIST, TypeKind.MAP):
        found = literal(node)
        if not accepts(wanted, found.type):
            is_other = found.type.kind is not wanted.kind
            said = (wanted.phrase, found.type.phrase) if is_other else (wanted.detail, found.type.detail)
            raise WrongValue(f"must be {said[0]}", label=f"this is {said[1]}")
        return found
    if not isinstance(node, ScalarNode):
        raise WrongValue(f"must be {wanted.phrase}", label=describe([] if isinstance(node, SequenceNode) else {}))
    return Datum(_scalar(node, wanted), wanted, node.span)


def _scalar(scalar: ScalarNode, wanted: Type) -> Value:
    value = plain_value(scalar) if scalar.filled is None else scalar.filled
    label = "" if isinstance(value, Quantity) else describe(value)
    if wanted.dimension:
        try:
            return to_si(value, wanted.dimension)
        except UnitError as error:
            raise WrongValue(error.message, label=error.detail or label, help=error.help) from None
    if wanted.kind is TypeKind.COUNT:
        count = value.value if isinstance(value, Quantity) else value
        if isinstance(count, bool) or not isinstance(count, int | float) or count < 0 or count != int(count):
            raise WrongValue("must be a whole number, at least 0", label=label)
        return float(count)
    if wanted.kind is TypeKind.FLAG:
        if not isinstance(value, bool):
            raise WrongValue("must be true or false", label=label)
        return value
    text = scalar.text if scalar.filled is None else str(scalar.filled)
    if wanted.kind is TypeKind.CHOICE and text not in wanted.choices:
        choices = ", ".join(wanted.choices)
        near = surely_meant(text, wanted.choices)
        help_text = f"{DID_YOU_MEAN} '{near}'?" if near else f"choices: {choices}"
        raise WrongValue(f"is not one of the choices: '{text}'", help=help_text)
    return text


def _measured(scalar: ScalarNode) -> object:
    value = plain_value(scalar)
    if isinstance(value, str) and scalar.plain:
        try:
            return parse_quantity(value)
        except UnitError:
            return value
    return "" if value is None else value


def _typed(value: object) -> tuple[Value, Type]:
    match value:
        case Quantity(value=number, dimension=dimension):
            return number, quantity_of(dimension)
        case bool():
            return value, FLAG
        case int():
            return float(value), COUNT
        case float():
            return value, quantity_of(NUMBER)
        case _:
            return str(value), TEXT
