"""Actions, services and topics as skills: arguments, the goal made from them, what a result means."""

import math
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import Any, TypeVar

from rbxcompose.base.config import Place
from rbxcompose.base.expressions import types
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.units import NUMBER, TIME, Dimension
from rbxcompose.missions.program.program import Skill
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import INTEGERS, FieldShape, attribute, parse_type
from rbxcompose.msgs.fields import ArrayEntries, Measures, NumberRange
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, Quaternion
from rbxcompose.msgs.plain import from_plain, to_plain
from rbxcompose.msgs.stamps import to_duration, to_seconds
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.types import Action, Message, Service

M = TypeVar("M", bound=Message)

FRAME = "map"  # the frame of places and poses in missions
SUCCESS = "success"  # the field of a response that reports success
STAMPED, POSED = "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/Pose"
LASTING = "builtin_interfaces/msg/Duration"

_TYPES: Mapping[str, types.Type] = {
    STAMPED: types.POSE,
    POSED: types.POSE,
    LASTING: types.quantity_of(TIME),
    "string": types.TEXT,
    "bool": types.FLAG,
    **dict.fromkeys(("float32", "float64"), types.quantity_of(NUMBER)),
    **{f"{sign}int{bits}": types.COUNT for sign in ("", "u") for bits in (8, 16, 32, 64)},
}


def skill_of(
    action: type[Action[Any, Any, Any]],
    name: str,
    claims: str = "",
    restartable: bool = True,
    *,
    pausable: bool = False,
    outcomes: Mapping[str, str] = MappingProxyType({}),
    entries: ArrayEntries | None = None,
    measures: Measures = MappingProxyType({}),
    choices: Mapping[str, Collection[str]] = MappingProxyType({}),
    ranges: Mapping[str, NumberRange] = MappingProxyType({}),
    may_lack: bool = False,
) -> Skill:
    """Return an action as a skill: the fields of its goal are the arguments, the first one is the main one.

    A field that is not a pose, time, text, flag or number is not an argument and keeps its zero value. `measures` are
    the dimensions of numbers, also of those in nested messages, which become arguments by that: maps, or lists of maps.
    `choices` are the words that texts may be, `ranges` what numbers may be. A main argument that is a pose, a time or
    has a dimension is required unless it `may_lack`. With `entries`, those are arguments, too, and only a text with
    choices is the main one.
    """
    asked, results = _asked(action.Goal, entries, measures, choices), result_fields(action.Result)
    if may_lack:
        asked = (*asked[:2], frozenset())
    return Skill(name, *asked, claims, restartable, pausable, dict(outcomes), results, entries, dict(ranges))


def topic_skill(
    order: type[Message],
    name: str,
    end: type[Message] | None = None,
    claims: str = "",
    restartable: bool = True,
    *,
    outcomes: Mapping[str, str] = MappingProxyType({}),
    entries: ArrayEntries | None = None,
) -> Skill:
    """Return orders on a topic as a skill whose ends are messages `end`; its arguments are as for an action.

    Without `end`, it has no results.
    """
    results = result_fields(end) if end is not None else {}
    asked = _asked(order, entries)
    return Skill(name, *asked, claims, restartable, outcomes=dict(outcomes), results=results, entries=entries)


def service_skill(service: type[Service[Any, Any]], name: str) -> Skill | None:
    """Return a service as a skill; None if its response does not report success."""
    if service.Response.FIELDS.get(SUCCESS) != "bool":
        return None
    arguments, results = typed_fields(service.Request), result_fields(service.Response)
    return Skill(name, arguments, next(iter(arguments), ""), results=results)


def _asked(
    message: type[Message],
    entries: ArrayEntries | None = None,
    measures: Measures = MappingProxyType({}),
    choices: Mapping[str, Collection[str]] = MappingProxyType({}),
) -> tuple[dict[str, types.Type], str, frozenset[str]]:
    """Return the arguments that a message has fields or entries for, the main one, and the required ones."""
    arguments = _measured_fields(message, measures)
    arguments |= {name: types.choice_of(*words) for name, words in choices.items()}
    if entries is not None:
        main = next(iter(choices), "")
        return (
            {name: types.quantity_of(dimension) for name, dimension in entries.each.items()} | arguments,
            main,
            frozenset(),
        )
    main = next(iter(arguments), "")
    is_needed = main in measures or (main and message.FIELDS[main] in (STAMPED, POSED, LASTING))
    needed = frozenset({main} if is_needed else ())
    return arguments, main, needed


def _measured_fields(message: type[Message], measures: Measures) -> dict[str, types.Type]:
    """Return the types of the fields that missions understand or that have measures, in order."""
    known = typed_fields(message)
    found = {
        name: _measured(ros, measures[name]) if name in measures else known.get(name)
        for name, ros in message.FIELDS.items()
    }
    return {name: type_ for name, type_ in found.items() if type_ is not None}


def _measured(ros: str, measure: Dimension | Measures | None) -> types.Type:
    """Return the type of a field: a nested message is a map, an array a list."""
    field_type = parse_type(ros)
    one = types.UNKNOWN
    if isinstance(measure, Mapping):
        one = types.record_of(_measured_fields(registry.message(field_type.base), measure))
    elif measure is not None:
        one = types.quantity_of(measure)
    return one if field_type.shape is FieldShape.SINGLE else types.list_of(one)


def typed_fields(message: type[Message]) -> dict[str, types.Type]:
    """Return the types of the fields that missions understand, in order."""
    return {field: _TYPES[ros] for field, ros in message.FIELDS.items() if ros in _TYPES}


def result_fields(message: type[Message]) -> dict[str, types.Type]:
    """Return the types of the fields of a result that missions understand, in order: also lists of texts."""
    known = {**_TYPES, "string[]": types.list_of(types.TEXT)}
    return {field: known[ros] for field, ros in message.FIELDS.items() if ros in known}


def goal_of(
    action: type[Action[Any, Any, Any]], arguments: Mapping[str, Value], entries: ArrayEntries | None = None
) -> Message:
    """Return the goal with these arguments; places and poses are in `map`.

    Raises:
        KeyError: if the goal has no such field or entry.
        ValueError: if a value does not fit into its field.
    """
    return filled(action.Goal, arguments, entries)


def filled(message: type[Message], arguments: Mapping[str, Value], entries: ArrayEntries | None = None) -> Message:
    """Return a message whose fields and entries have these values; raises as `goal_of` does."""
    fields, own = message.FIELDS, dict(arguments)
    if entries is not None:
        names = [name for name in own if name in entries.each and name not in typed_fields(message)]
        own |= entries.arrays({name: own.pop(name) for name in names})
    return message(**{attribute(name): _made(fields[name], value) for name, value in own.items()})


def _made(ros: str, value: Any) -> object:
    if ros in _MAKERS:
        return _MAKERS[ros](value)
    field_type = parse_type(ros)
    inner = registry.message(field_type.base)
    if field_type.shape is FieldShape.SINGLE:
        return message_of(inner, value)
    return tuple(message_of(inner, item) for item in value)


def message_of(message: type[M], fields: Mapping[str, Value]) -> M:
    """Return a message with fields of any shape, nested ones as maps.

    Raises:
        ValueError: with the reason, if a field does not exist or a value does not fit into it.
    """
    made, findings = from_plain(
        message, {name: _fitted(message.FIELDS.get(name, ""), field) for name, field in fields.items()}
    )
    if made is None:
        raise ValueError(findings[0].message)
    return made


def _fitted(ros_type: str, value: Any) -> Any:
    """Return a value of a mission as data for a field: places become poses, whole floats become integers."""
    if not ros_type:
        return value
    base = parse_type(ros_type).base
    if isinstance(value, Mapping):
        known = registry.message(base).FIELDS if "/" in base else {}
        return {name: _fitted(known.get(name, ""), entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_fitted(base, item) for item in value]
    if base in _POSES and isinstance(value, Place | Pose2):
        return to_plain(_POSES[base](value))
    if base == LASTING and isinstance(value, int | float):
        return to_plain(to_duration(value))
    return int(value) if base in INTEGERS and isinstance(value, float) and value.is_integer() else value


def values_of(message: Message | None) -> dict[str, Value]:
    """Return the fields of a result by name: durations in [s], other nested messages as maps."""
    if message is None:
        return {}
    lasting = [attribute(name) for name, ros in message.FIELDS.items() if ros == LASTING]
    return {**to_plain(message), **{name: to_seconds(getattr(message, name)) for name in lasting}}


def _pose(value: Any) -> Pose:
    half = value.heading / 2
    return Pose(position=Point(x=value.x, y=value.y), orientation=Quaternion(z=math.sin(half), w=math.cos(half)))


def _stamped(value: Any) -> PoseStamped:
    return PoseStamped(header=Header(frame_id=FRAME), pose=_pose(value))


def _whole(value: Any) -> int:
    if value != int(value):
        raise ValueError(f"{value} is no whole number")
    return int(value)


_MAKERS: Mapping[str, Callable[[Any], object]] = {
    STAMPED: _stamped,
    POSED: _pose,
    LASTING: to_duration,
    "string": str,
    "bool": bool,
    **dict.fromkeys(("float32", "float64"), float),
    **dict.fromkeys(("string[]", "float32[]", "float64[]"), tuple),
    **{ros: _whole for ros, wanted in _TYPES.items() if wanted == types.COUNT},
}
_POSES: Mapping[str, Callable[[Any], Message]] = {STAMPED: _stamped, POSED: _pose}
