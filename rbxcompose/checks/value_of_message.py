"""A value that does not fit the message that it comes from."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.types import TYPES, TypeKind
from rbxcompose.findings import Finding
from rbxcompose.missions.program.sources import ValueSource
from rbxcompose.model.robot import Robot
from rbxcompose.model.values import fitting_kinds
from rbxcompose.msgs.field_paths import NoFieldError, field_type
from rbxcompose.sections.values import ValueModel
from rbxcompose.units import UNITS

_OF_TOPIC = ("field", "type")  # keys that are for data from a topic
_WORDS = {TypeKind.TEXT: "write 'type: text'", TypeKind.FLAG: "write 'type: flag'"}


@check("RBX4161", is_fixable=True)
def value_of_message(robot: Robot) -> Iterator[Finding]:
    """A value does not fit its message."""
    for name, entry in robot.manifest.values.items():
        source = robot.values.get(name)
        if entry.port is not None:
            yield from _without_effect(robot, name, entry)
        elif source is not None:
            yield from _unit(robot, name, entry)
            yield from _field(robot, name, entry, source)


def _without_effect(robot: Robot, name: str, entry: ValueModel) -> Iterator[Finding]:
    for key in _OF_TOPIC:
        if getattr(entry, key) is not None:
            message = f"'{key}' has no effect on the value '{name}': its port has a message of its own"
            yield value_of_message.at(robot.key("values", name, key), message, help=f"remove '{key}'")


def _unit(robot: Robot, name: str, entry: ValueModel) -> Iterator[Finding]:
    declared = TYPES.get(entry.type or "")
    unit = UNITS.get(entry.unit or "")
    if declared and unit and declared.dimension != unit.dimension:
        message = f"the value '{name}' is {declared.phrase}, and '{unit.name}' is a unit of {unit.dimension.phrase}"
        help_text = f"write 'type: {unit.dimension.name}', or another unit"
        yield value_of_message.at(robot.value("values", name, "unit"), message, help=help_text)


def _field(robot: Robot, name: str, entry: ValueModel, source: ValueSource) -> Iterator[Finding]:
    try:
        ros = field_type(source.message, source.field)
    except NoFieldError as error:
        span = robot.value("values", name, "field" if entry.field else "topic")
        message = f"the value '{name}' comes from a field that {error.message} does not have: '{error.name}'"
        yield value_of_message.misspelt(span, message, error.name, error.fields, "its fields", within=entry.field or "")
        return
    fitting, declared = fitting_kinds(ros), TYPES.get(entry.type or "")
    if fitting and declared and declared.kind not in fitting:
        message = f"the value '{name}' is {declared.phrase}, but '{source.field}' of {source.message} is a {ros}"
        help_text = _WORDS.get(fitting[0], "write 'type: number', or what it measures")
        yield value_of_message.at(robot.value("values", name, "type"), message, help=help_text)
