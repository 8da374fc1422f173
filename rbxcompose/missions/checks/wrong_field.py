"""Fields of messages, and their values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.expressions.check import check
from rbxcompose.expressions.types import TEXT, UNKNOWN, TypeKind
from rbxcompose.findings import Finding, Span
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import called, published
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.scope_types import View
from rbxcompose.missions.language.argument_types import check_written
from rbxcompose.missions.program.messages import MessageTemplate, TemplateShape, WrittenValue
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldShape, parse_type
from rbxcompose.msgs.measures import measure_of
from rbxcompose.msgs.types import Message
from rbxcompose.units import NUMBER, QUOTIENT, Dimension, example

FITTING = {  # the types of expressions that fit a field, by its ROS type; all others are numbers
    "bool": (TypeKind.FLAG,),
    "string": (TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE),
}
BYTES = ("uint8", "byte", "char")  # a text may be written for a list of them
NUMBERS = (TypeKind.QUANTITY, TypeKind.COUNT)


@mission_check("RBX4151", is_fixable=True)
def wrong_field(mission: Examined) -> Iterator[Finding]:
    """A message of a mission does not fit its type."""
    topics, services = mission.robot.topics, mission.robot.services
    for view in mission.views:
        for message in published(view.node):
            if message.target.text in topics:
                yield from _check_body(view, message, registry.message(topics[message.target.text]))
        for message in called(view.node):
            if message.target.text in services:
                yield from _check_body(view, message, registry.service(services[message.target.text]).Request)


def _check_body(view: View, message: MessageTemplate, ros: type[Message]) -> Iterator[Finding]:
    body = message.body
    if body is None:
        return
    if isinstance(body, Mapping):
        yield from _check_fields(view, body, ros, message.keys)
    elif len(ros.FIELDS) == 1:
        yield from _check_value(view, body, next(iter(ros.FIELDS.values())), message.target.span)
    else:
        told = f"{ros.TYPE} has several fields: name them"
        help_text = f"they are {', '.join(ros.FIELDS)}" if ros.FIELDS else "it has no fields at all"
        yield wrong_field.at(_span_of(body) or message.target.span, told, help=help_text)


def _check_fields(
    view: View,
    body: Mapping[str, TemplateShape],
    ros: type[Message],
    keys: Mapping[tuple[str, ...], Span],
    path: tuple[str, ...] = (),
    measured: Dimension | None = None,
) -> Iterator[Finding]:
    for name, shape in body.items():
        span = keys[(*path, name)]
        if name not in ros.FIELDS:
            told = f"{ros.TYPE} has no field '{name}'"
            yield wrong_field.misspelt(span, told, name, ros.FIELDS, "its fields", taken=body)
        elif isinstance(shape, Mapping) and "/" in parse_type(ros.FIELDS[name]).base:
            inner = registry.message(parse_type(ros.FIELDS[name]).base)
            below = measure_of(ros.TYPE, name) or measured
            yield from _check_fields(view, shape, inner, keys, (*path, name), below)
        else:
            found = list(_check_value(view, shape, ros.FIELDS[name], span))
            yield from found or _measured(view, shape, measure_of(ros.TYPE, name) or measured)


def _check_value(view: View, shape: TemplateShape, ros_type: str, span: Span) -> Iterator[Finding]:
    field = parse_type(ros_type)
    if isinstance(shape, Mapping):
        yield wrong_field.at(span, f"a map does not fit the type {ros_type}")
    elif isinstance(shape, WrittenValue) and (field.shape is FieldShape.SINGLE or field.base in BYTES):
        yield from _check_written(view, shape, field.base, ros_type)
    elif isinstance(shape, WrittenValue):
        yield from _check_list(view, shape, ros_type)
    elif field.shape is FieldShape.SINGLE:
        yield wrong_field.at(_span_of(shape) or span, f"a list does not fit the type {ros_type}")
    else:
        for item in shape if not field.is_message else ():
            yield from _check_value(view, item, field.base, span)


def _measured(view: View, shape: TemplateShape, wanted: Dimension | None) -> Iterator[Finding]:
    """Yield a finding if a value with a unit is no value of what a field measures."""
    if wanted is None or not isinstance(shape, WrittenValue) or shape.expression is None:
        return
    given, _ = check(shape.expression, view.scope)
    if given.dimension not in (None, NUMBER, QUOTIENT, wanted):
        message = f"this must be {wanted.phrase}; it is {given.phrase}"
        yield wrong_field.at(shape.scalar.span, message, help=f"write {wanted.phrase}, such as '{example(wanted)}'")


def _check_list(view: View, shape: WrittenValue, ros_type: str) -> Iterator[Finding]:
    """Yield a finding if a single value is where a list must be; a name may refer to a list."""
    found = check(shape.expression, view.scope)[0].kind if shape.expression else TypeKind.TEXT
    if found not in (TypeKind.LIST, TypeKind.UNKNOWN):
        help_text = f"write '[{shape.scalar.text}]'"
        yield wrong_field.at(shape.scalar.span, f"this must be a list, {ros_type}", help=help_text)


def _check_written(view: View, shape: WrittenValue, base: str, ros_type: str) -> Iterator[Finding]:
    if base == "string":
        yield from check_written(view, shape.scalar, TEXT, wrong_field)
    elif shape.expression is None:
        yield wrong_field.at(shape.scalar.span, f"'{shape.scalar.text}' is no value of the type {ros_type}")
    else:
        found = list(view.typed(shape.expression, UNKNOWN, shape.scalar, wrong_field))
        yield from found
        given, _ = check(shape.expression, view.scope)
        if not found and "/" in base and given.kind in (*NUMBERS, TypeKind.FLAG, TypeKind.TEXT, TypeKind.CHOICE):
            yield _no_message(shape, base)
        if not found and given.kind not in (*FITTING.get(base, NUMBERS), TypeKind.UNKNOWN) and "/" not in base:
            yield wrong_field.at(shape.scalar.span, f"this must be of the type {ros_type}; it is {given.phrase}")


def _no_message(shape: WrittenValue, base: str) -> Finding:
    """Return the finding about a single value in the place of a message."""
    fields = registry.message(base).FIELDS
    first = next(iter(fields), "")
    help_text = f"write '{{{first}: {shape.scalar.text}}}'; its fields are {', '.join(fields)}" if first else ""
    return wrong_field.at(shape.scalar.span, f"this must be a {base}, not a single value", help=help_text)


def _span_of(shape: TemplateShape) -> Span | None:
    """Return the span of a value, or of the first one in a list."""
    match shape:
        case WrittenValue(scalar=scalar):
            return scalar.span
        case (first, *_):
            return _span_of(first)
    return None
