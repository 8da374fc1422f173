"""Messages as clients of rosbridge write them in JSON: NaN is null, arrays of bytes are base64, defaults are left out.

What ROS 1 writes otherwise is understood, too: `secs` and `nsecs` of times, `seq` of headers.
"""

import json
import math
from base64 import b64decode, b64encode
from dataclasses import replace
from functools import cache
from typing import Any, TypeVar

from rbxcompose.msgs import registry
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.definitions import FLOATS, INTEGERS, OCTETS, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.plain import from_plain, shortest
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.types import Message

M = TypeVar("M", bound=Message)

_HEADER = "std_msgs/msg/Header"
_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_ROS1 = {"secs": "sec", "nsecs": "nanosec"}


class WrongMessageError(ValueError):
    """Raised for data that are no message of their type."""


def encoded(message: Message) -> str:
    """Return a message as JSON text."""
    return json.dumps(to_json(message), separators=(",", ":"), allow_nan=False)


def to_json(message: Message) -> dict[str, Any]:
    """Return a message as data for JSON."""
    return {name: _written(type_, getattr(message, field)) for name, field, type_ in _fields(message.TYPE)}


@cache
def _fields(message: str) -> tuple[tuple[str, str, FieldType], ...]:
    """Return name, attribute and type of each field of a message."""
    fields = registry.message(message).FIELDS
    return tuple((name, attribute(name), parse_type(text)) for name, text in fields.items())


def _written(type_: FieldType, value: Any) -> Any:
    if type_.shape is not FieldShape.SINGLE:
        if type_.base in OCTETS:
            return b64encode(bytes(value)).decode()
        single = FieldType(type_.base)
        return [_written(single, item) for item in (value.tolist() if hasattr(value, "tolist") else value)]
    if type_.is_message:
        return to_json(value)
    if type_.base in FLOATS:
        if not math.isfinite(value):
            return None
        return shortest(value) if type_.base == "float32" else value
    return value


def from_json(message: type[M], data: object, stamp: int) -> M:
    """Return the message that data represent; a header without a stamp gets `stamp` [ns].

    Raises:
        WrongMessageError: if they represent none.
    """
    try:
        made, findings = from_plain(message, _read(FieldType(message.TYPE), data))
    except ValueError as error:  # base64, or a text that no UTF-8 can hold
        raise WrongMessageError(str(error)) from error
    if made is None:
        raise WrongMessageError(findings[0].message)
    stamped: Any = made
    if message.FIELDS.get("header") == _HEADER and stamped.header.stamp == Time():
        stamped = replace(stamped, header=replace(stamped.header, stamp=to_time(stamp)))
    return stamped  # type: ignore[no-any-return]


def arguments(message: type[Message], data: object) -> object:
    """Return the arguments of a service as the fields of its request: they may be a list, in the order of the fields.

    Raises:
        WrongMessageError: if there are too many.
    """
    if not isinstance(data, list):
        return data
    if len(data) > len(message.FIELDS):
        raise WrongMessageError(f"{message.TYPE} has {len(message.FIELDS)} fields, not {len(data)}")
    return dict(zip(message.FIELDS, data, strict=False))


def _read(type_: FieldType, value: Any) -> Any:
    """Return data as `from_plain` takes them."""
    if type_.shape is not FieldShape.SINGLE:
        if type_.base in OCTETS and isinstance(value, str):
            return b64decode(value, validate=True)
        single = FieldType(type_.base)
        return [_read(single, item) for item in value] if isinstance(value, list) else value
    if type_.is_message:
        return _read_fields(type_.base, value) if isinstance(value, dict) else value
    if type_.base in FLOATS:
        return math.nan if value is None else value
    if type_.base in INTEGERS and isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, str):
        value.encode()  # JSON can hold half of a pair of surrogates
    return value


def _read_fields(name: str, data: dict[str, Any]) -> dict[str, Any]:
    if name in _TIMES:
        data = {_ROS1.get(key, key): value for key, value in data.items()}
    types = {field: type_ for field, _, type_ in _fields(name)}
    ignored = "seq" if name == _HEADER else None
    return {key: _read(types[key], value) if key in types else value for key, value in data.items() if key != ignored}
