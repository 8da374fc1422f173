"""Messages as clients of rosbridge write them in JSON: NaN is null, arrays of bytes are base64, defaults are left out.

What ROS 1 writes otherwise is understood, too: `secs` and `nsecs` of times, `seq` of headers.
"""

import json
import math
from base64 import b64decode, b64encode
from dataclasses import replace
from functools import cache
from typing import Any, TypeVar

from rbxcompose.base.arrays import np
from rbxcompose.msgs import registry
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.definitions import FLOATS, INTEGERS, OCTETS, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.plain import from_plain, shortest
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.ports import BULK

M = TypeVar("M", bound=Message)

MOST_ENTRIES = BULK.entries  # texts, flags and messages in all lists of a message: as many as the bus takes
_SHOWN = 60  # characters of a name that is wrong
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
        if hasattr(value, "dtype") and type_.base in FLOATS:  # many numbers: numpy writes float32 the shortest way
            numbers = value.astype(str).astype(float) if type_.base == "float32" else value
            return [number if math.isfinite(number) else None for number in numbers.tolist()]
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
    reading = _Reading()
    try:
        made, findings = from_plain(message, reading.of(FieldType(message.TYPE), data))
    except ValueError as error:  # a list, base64, or a text that no UTF-8 can hold
        raise WrongMessageError(": ".join((*filter(None, [".".join(reading.path)]), str(error)))) from error
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


class _Reading:
    """Turns data into what `from_plain` takes; a client must not hold up the others by a message that takes long."""

    def __init__(self) -> None:
        self._left = MOST_ENTRIES
        self.path: list[str] = []  # of the field that is read

    def of(self, type_: FieldType, value: Any) -> Any:
        """Return a value of a type."""
        if type_.shape is not FieldShape.SINGLE:
            return self._list(type_, value) if isinstance(value, list | str) else value
        if type_.is_message:
            return self._fields(type_.base, value) if isinstance(value, dict) else value
        if type_.base in FLOATS:
            return math.nan if value is None else value
        if type_.base in INTEGERS and isinstance(value, float) and value.is_integer():
            return int(value)
        if isinstance(value, str):
            value.encode()  # JSON can hold half of a pair of surrogates
        return value

    def _list(self, type_: FieldType, value: Any) -> Any:
        if isinstance(value, str):
            return _bytes(value) if type_.base in OCTETS else value
        if type_.base in FLOATS or type_.base in INTEGERS or type_.base in OCTETS:
            numbers = numbers_of(type_.base, value)
            return bytes(numbers) if type_.base in OCTETS else numbers
        self._left -= len(value)
        if self._left < 0:
            raise WrongMessageError(f"its lists have more than {MOST_ENTRIES} texts and messages")
        single = FieldType(type_.base)
        return [self.of(single, item) for item in value]

    def _fields(self, name: str, data: dict[str, Any]) -> dict[str, Any]:
        if name in _TIMES:
            data = {_ROS1.get(key, key): value for key, value in data.items()}
        types, read = {field: type_ for field, _, type_ in _fields(name)}, {}
        for key, value in data.items():
            if key in types:
                self.path.append(key)
                read[key] = self.of(types[key], value)
                self.path.pop()
            elif not (key == "seq" and name == _HEADER):
                raise WrongMessageError(f"{name} has no field '{key[:_SHOWN]}'")
        return read


def _bytes(text: str) -> bytes:
    try:
        return b64decode(text, validate=True)
    except ValueError as error:
        raise WrongMessageError("expected base64, or a list of numbers from 0 to 255") from error


def numbers_of(base: str, values: list[Any]) -> Any:
    """Return numbers of a type of ROS as an array; null is NaN.

    Raises:
        WrongMessageError: if some are not of that type.
    """
    wanted = np.dtype({"byte": "uint8", "char": "uint8"}.get(base, base))
    made = _floats(wanted, values) if wanted.kind == "f" else _integers(wanted, values)
    if made is None:
        raise WrongMessageError(f"expected a list of numbers ({base})")
    return made


def _floats(wanted: np.dtype[Any], values: list[Any]) -> Any:
    """Return them as an array, or None. Types are looked at first: among texts, numpy would make a text of each."""
    kinds = set(map(type, values))
    if not kinds <= {int, float, type(None)}:
        return None
    try:
        found = np.array([math.nan if value is None else value for value in values], "float64")
    except OverflowError:
        return None
    with np.errstate(over="ignore"):
        made = found.astype(wanted)
    return made if (np.isinf(made) == np.isinf(found)).all() else None


def _integers(wanted: np.dtype[Any], values: list[Any]) -> Any:
    """Return them as an array, or None. Those of 64 bits must not pass through floats."""
    kinds = set(map(type, values))
    if not kinds <= {int, float}:
        return None
    if float in kinds:
        values = [int(value) if isinstance(value, float) and value.is_integer() else value for value in values]
        if float in set(map(type, values)):
            return None
    limits = np.iinfo(wanted)
    return np.array(values, wanted) if not values or limits.min <= min(values) <= max(values) <= limits.max else None
