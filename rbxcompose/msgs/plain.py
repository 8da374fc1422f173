"""Messages as plain data (maps, lists, numbers, texts, flags), and back with every mistake as a finding.

Bytes are lists of numbers here; on the way back, bytes and arrays of numpy are taken as they are. Omitted fields keep
their defaults.
"""

import struct
from collections.abc import Mapping
from dataclasses import field
from typing import Any, Generic, Protocol, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Span, kind, suggest
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FLOATS, OCTETS, RANGES, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.types import Message

M = TypeVar("M", bound=Message)
Key = str | int
KeyPath = tuple[Key, ...]  # from the message: ("pose", "position", "x") or ("transforms", 0)

NO_FIELD = kind("RBX9023")
WRONG_VALUE = kind("RBX9024")

_FLOAT32 = struct.Struct("<f")
_DIGITS = range(6, 9)  # significant digits; a float32 never needs more than nine


class TextPlaces(Protocol):
    """The positions of plain data in its text."""

    def key(self, path: KeyPath) -> Span | None:
        """Return the position of a key."""
        ...

    def value(self, path: KeyPath) -> Span | None:
        """Return the position of a value."""
        ...


class NoPlaces:
    """The positions of data without a text."""

    def key(self, path: KeyPath) -> None:
        """Return no position."""

    def value(self, path: KeyPath) -> None:
        """Return no position."""


def to_plain(message: Message) -> dict[str, Any]:
    """Return a message as plain data; a `float32` becomes the shortest number that reads back as the same."""
    return {
        name: _plain(parse_type(text), getattr(message, attribute(name))) for name, text in type(message).FIELDS.items()
    }


def _plain(type_: FieldType, value: Any) -> Any:
    if type_.shape is not FieldShape.SINGLE:
        single = FieldType(type_.base)
        return [_plain(single, one) for one in (value.tolist() if hasattr(value, "tolist") else value)]
    if type_.is_message:
        return to_plain(value)
    return shortest(value) if type_.base == "float32" else value


def shortest(value: float) -> float:
    """Return the shortest number that reads back as the same `float32`."""
    for digits in _DIGITS:
        short = float(f"{value:.{digits}g}")
        if _is_same(short, value):
            return short
    return value


def _is_same(short: float, value: float) -> bool:
    try:
        return _FLOAT32.pack(short) == _FLOAT32.pack(value)
    except OverflowError:  # rounded up beyond the largest float32
        return False


@dataclass(slots=True)
class _Reading(Generic[M]):
    """One reading of plain data: its positions, and the mistakes so far."""

    places: TextPlaces
    findings: list[Finding] = field(default_factory=list)

    def message(self, message: type[M], data: object, path: KeyPath) -> M | None:
        """Return the message, or None with a finding."""
        if data is None:
            data = {}  # an empty text: all defaults
        if not isinstance(data, Mapping):
            self._wrong(path, f"{message.TYPE} is a map of its fields")
            return None
        values = {}
        for name, value in data.items():
            if name not in message.FIELDS:
                words = f"{message.TYPE} has no field '{name}'"
                place = self.places.key((*path, name))
                self.findings.append(NO_FIELD.at(place, words, help=suggest(str(name), message.FIELDS, "its fields")))
            else:
                values[attribute(name)] = self._value(parse_type(message.FIELDS[name]), value, (*path, name))
        return None if self.findings else message(**values)

    def _value(self, type_: FieldType, value: object, path: KeyPath) -> Any:
        if type_.shape is not FieldShape.SINGLE:
            is_ready = hasattr(value, "dtype") or (isinstance(value, bytes) and type_.base in OCTETS)
            if not (is_ready or isinstance(value, list | tuple)):
                return self._wrong(path, f"expected a list ({type_})")
            entries: Any = value
            count, length = len(entries), type_.length
            if (type_.shape is FieldShape.ARRAY and count != length) or (
                type_.shape is FieldShape.BOUNDED and count > length
            ):
                most = "at most " if type_.shape is FieldShape.BOUNDED else ""
                return self._wrong(path, f"{most}{length} values are expected, not {count}")
            if is_ready:
                return value
            single = FieldType(type_.base, text_limit=type_.text_limit)
            values = [self._value(single, one, (*path, index)) for index, one in enumerate(entries)]
            if self.findings:
                return None
            return bytes(values) if type_.base in OCTETS else tuple(values)
        if type_.is_message:
            nested: type[Any] = registry.message(type_.base)
            return self.message(nested, value, path)
        if type_.base == "string":
            return self._text(type_, value, path)
        if type_.base == "bool":
            return value if isinstance(value, bool) else self._wrong(path, "expected true or false")
        return self._number(type_.base, value, path)

    def _text(self, type_: FieldType, value: object, path: KeyPath) -> Any:
        if not isinstance(value, str):
            return self._wrong(path, "expected text; quote a number or a flag that is meant as text")
        limit = type_.text_limit
        if limit and len(value.encode()) > limit:
            return self._wrong(path, f"at most {limit} bytes of text are expected, not {len(value.encode())}")
        return value

    def _number(self, base: str, value: object, path: KeyPath) -> Any:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return self._wrong(path, f"expected a number ({base}), without a unit")
        if base in FLOATS:
            return self._float(base, value, path)
        low, high = RANGES[base]
        if not isinstance(value, int) or not low <= value <= high:
            return self._wrong(path, f"expected a whole number from {low} to {high} ({base})")
        return value

    def _float(self, base: str, value: float, path: KeyPath) -> Any:
        try:
            number = float(value)
            return number if base == "float64" else _FLOAT32.unpack(_FLOAT32.pack(number))[0]
        except OverflowError:
            return self._wrong(path, f"this number is too large for a {base}")

    def _wrong(self, path: KeyPath, message: str) -> None:
        where = ".".join(map(str, path))
        self.findings.append(WRONG_VALUE.at(self.places.value(path), f"{where}: {message}" if where else message))


def from_plain(message: type[M], data: object, places: TextPlaces | None = None) -> tuple[M | None, list[Finding]]:
    """Return the message that plain data represents, or None and what is wrong with the data."""
    reading: _Reading[M] = _Reading(places or NoPlaces())
    made = reading.message(message, data, ())
    return (None if reading.findings else made), reading.findings
