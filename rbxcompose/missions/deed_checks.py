"""What can be wrong with what a node sets or sends: names of data, topics and services, fields and their values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from rbxcompose.expressions.check import check
from rbxcompose.expressions.types import COUNT, TEXT, UNKNOWN, TypeKind, quantity_of
from rbxcompose.findings import Finding, Span, correction, suggest
from rbxcompose.missions import codes, deed_codes
from rbxcompose.missions.messages import Message, Shape, Written
from rbxcompose.missions.moments import Moments
from rbxcompose.missions.program import Assignment
from rbxcompose.missions.typing import check_written
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import parse_type
from rbxcompose.msgs.types import Message as RosMessage
from rbxcompose.units import NUMBER

if TYPE_CHECKING:
    from rbxcompose.missions.views import View

FITTING = {  # the types of expressions that fit a field, by its ROS type; all others are numbers
    "bool": (TypeKind.FLAG,),
    "string": (TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE),
}
NUMBERS = (TypeKind.QUANTITY, TypeKind.COUNT)


def check_assignments(view: View, assignments: tuple[Assignment, ...]) -> Iterator[Finding]:
    """Yield what is wrong with what is set: only data can be, to values of their type."""
    for assignment in assignments:
        name, asked, data = assignment.name, assignment.asked, view.program.data
        if name not in data:
            message = f"only data can be set; the mission has no datum '{name}'"
            help_text = suggest(name, data, "its data") or f"write '{name}: ...' under 'data'"
            taken = [one.name for one in assignments]
            fix = correction(name, data, assignment.span, taken=taken)
            yield codes.UNKNOWN_NAME.at(assignment.span, message, help=help_text, fix=fix)
        kept = data[name].type if name in data else UNKNOWN
        wanted = quantity_of(NUMBER) if kept == COUNT else kept
        yield from view.typed(asked.expression, wanted, asked.scalar, codes.WRONG_TYPE)


def check_moments(view: View, moments: object) -> Iterator[Finding]:
    """Yield what is wrong with hooks."""
    for deeds in moments.deeds.values() if isinstance(moments, Moments) else ():
        yield from check_assignments(view, deeds.assignments)
        if deeds.message:
            yield from check_published(view, deeds.message)


def check_published(view: View, message: Message) -> Iterator[Finding]:
    """Yield what is wrong with a message that is published."""
    ros_type = view.robot.topics.get(message.target.text)
    if ros_type is None:
        yield from _nowhere(view, message, "topic", view.robot.topics)
    else:
        yield from _check_body(view, message, registry.message(ros_type))


def check_called(view: View, message: Message) -> Iterator[Finding]:
    """Yield what is wrong with the request of a call."""
    ros_type = view.robot.services.get(message.target.text)
    if ros_type is None:
        yield from _nowhere(view, message, "service", view.robot.services)
    else:
        yield from _check_body(view, message, registry.service(ros_type).Request)


def _nowhere(view: View, message: Message, what: str, known: Mapping[str, str]) -> Iterator[Finding]:
    name = message.target.text
    if name and view.robot.is_complete:
        told = f"the robot has no {what} '{name}'"
        yield deed_codes.UNKNOWN_CHANNEL.misspelt(message.target.span, told, name, known, f"{what}s of this robot")


def _check_body(view: View, message: Message, ros: type[RosMessage]) -> Iterator[Finding]:
    body = message.body
    if body is None:
        return
    if isinstance(body, Mapping):
        yield from _check_fields(view, body, ros, message.keys)
    elif len(ros.FIELDS) == 1:
        yield from _check_value(view, body, next(iter(ros.FIELDS.values())), message.target.span, ())
    else:
        told = f"{ros.TYPE} has several fields: name them"
        help_text = f"they are {', '.join(ros.FIELDS)}" if ros.FIELDS else "it has no fields at all"
        yield deed_codes.WRONG_FIELD.at(_span_of(body) or message.target.span, told, help=help_text)


def _check_fields(
    view: View,
    body: Mapping[str, Shape],
    ros: type[RosMessage],
    keys: Mapping[tuple[str, ...], Span],
    path: tuple[str, ...] = (),
) -> Iterator[Finding]:
    for name, shape in body.items():
        span = keys[(*path, name)]
        if name not in ros.FIELDS:
            told = f"{ros.TYPE} has no field '{name}'"
            yield deed_codes.WRONG_FIELD.misspelt(span, told, name, ros.FIELDS, "its fields", taken=body)
        elif isinstance(shape, Mapping) and "/" in parse_type(ros.FIELDS[name]).base:
            inner = registry.message(parse_type(ros.FIELDS[name]).base)
            yield from _check_fields(view, shape, inner, keys, (*path, name))
        else:
            yield from _check_value(view, shape, ros.FIELDS[name], span, (*path, name))


def _check_value(view: View, shape: Shape, ros_type: str, span: Span, path: tuple[str, ...]) -> Iterator[Finding]:
    base = parse_type(ros_type).base
    if not isinstance(shape, Written):
        if isinstance(shape, Mapping):
            yield deed_codes.WRONG_FIELD.at(span, f"a map does not fit the type {ros_type}")
        return
    if base == "string":
        yield from check_written(view, shape.scalar, TEXT, deed_codes.WRONG_FIELD)
    elif shape.expression is None:
        yield deed_codes.WRONG_FIELD.at(shape.scalar.span, f"'{shape.scalar.text}' is no value of the type {ros_type}")
    else:
        found = list(view.typed(shape.expression, UNKNOWN, shape.scalar, deed_codes.WRONG_FIELD))
        yield from found
        kind = check(shape.expression, view.scope)[0].kind
        if not found and kind not in (*FITTING.get(base, NUMBERS), TypeKind.UNKNOWN) and "/" not in base:
            phrase = check(shape.expression, view.scope)[0].phrase
            yield deed_codes.WRONG_FIELD.at(shape.scalar.span, f"this must be of the type {ros_type}; it is {phrase}")


def _span_of(shape: Shape) -> Span | None:
    return shape.scalar.span if isinstance(shape, Written) else None
