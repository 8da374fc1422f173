"""Values: the field of a message that a `$name` of the missions refers to, and what it measures."""

from collections.abc import Mapping
from dataclasses import replace

from rbxcompose.base.expressions.types import TYPES, UNKNOWN, Type, TypeKind, choice_of, quantity_of
from rbxcompose.base.levels import Level
from rbxcompose.base.units import UNITS
from rbxcompose.compiler.model.robot import PortEnd, RobotComponent, resolve
from rbxcompose.compiler.sections.values import ValueModel
from rbxcompose.missions.sources import ValueSource
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldShape, FieldType
from rbxcompose.msgs.fields import NoFieldError, field_type
from rbxcompose.sdk.ports import In, Out, Qos

# The message for data from outside whose type nothing in the robot declares.
STANDARD = {"text": "std_msgs/msg/String", "flag": "std_msgs/msg/Bool", "count": "std_msgs/msg/Int32"}
NUMBER = "std_msgs/msg/Float32"
LEVELS_TOPIC, LEVELS_TYPE = "/diagnostics_agg", "diagnostic_msgs/msg/DiagnosticArray"
LEVEL_WORDS = tuple(level.name.lower() for level in Level)
DATA = "data"  # the field of the standard messages


def value_of(
    entry: ValueModel,
    components: Mapping[str, RobotComponent],
    types: Mapping[str, str],
    namespace: str,
    levels: Mapping[str, str],
) -> ValueSource | None:
    """Return what a value refers to, None if its source does not exist (a check reports that).

    `types` are the ROS types of the robot's topics; `levels` are the statuses whose levels are values, too, by
    what `port` names.
    """
    if entry.port is not None:
        if (status := levels.get(entry.port)) is not None:
            return ValueSource(LEVELS_TOPIC, LEVELS_TYPE, "level", type=choice_of(*LEVEL_WORDS), group=status)
        component, _, port = entry.port.partition(".")
        end = components[component].end(port) if component in components else None
        return _of_port(end, entry) if end else None
    if entry.topic is None:
        return None
    topic = resolve(entry.topic, namespace)
    message = types.get(topic) or STANDARD.get(entry.type or "", NUMBER)
    return _value(topic, message, entry.field or DATA, entry.unit or "", TYPES.get(entry.type or ""), entry.event)


def _of_port(end: PortEnd, entry: ValueModel) -> ValueSource | None:
    port = end.port
    if not isinstance(port, Out | In):
        return None
    fields = tuple(registry.message(end.type_name).FIELDS)
    if len(fields) != 1:
        return None  # a whole message is not a value
    found = _value(end.topic, end.type_name, fields[0], entry.unit or port.unit, None, entry.event)
    return replace(found, is_latched=port.qos is Qos.LATCHED)


def _value(
    topic: str, message: str, field: str, unit: str, declared: Type | None, is_event: bool | None
) -> ValueSource:
    known = UNITS.get(unit)
    times, per = (known.times, known.per) if known else (1.0, 1.0)
    measured = quantity_of(known.dimension) if known else _plain_type(message, field)
    return ValueSource(topic, message, field, times, per, declared or measured, is_event=bool(is_event))


def _plain_type(message: str, field: str) -> Type:
    try:
        ros = field_type(message, field)
    except NoFieldError:  # a check reports it
        return UNKNOWN
    fitting = fitting_kinds(ros)
    if not fitting:
        return UNKNOWN
    plain = {TypeKind.TEXT: TYPES["text"], TypeKind.FLAG: TYPES["flag"]}
    return plain.get(fitting[0], TYPES["number"])


def fitting_kinds(field: FieldType) -> tuple[TypeKind, ...]:
    """Return the kinds of values that a field may be; none for messages and lists."""
    if field.is_message or field.shape is not FieldShape.SINGLE:
        return ()
    if field.base == "string":
        return (TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE)
    return (TypeKind.FLAG,) if field.base == "bool" else (TypeKind.QUANTITY, TypeKind.COUNT)
