"""CDR: messages as the bytes that ROS 2 sends, little-endian (XCDR1).

Each number is aligned to its own size, counted from the end of the four-byte header. The layout of a class is
worked out once, at its first use: neighbouring numbers, including those of nested messages, become a single `struct`.
Decoding trusts nothing: it checks each count against the available bytes before it allocates memory.
"""

import math
import struct
from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from typing import Any, Protocol, TypeVar

from rbxcompose.base.arrays import np
from rbxcompose.msgs import registry
from rbxcompose.msgs.arrays import ArrayMessage, holds_numbers
from rbxcompose.msgs.definitions import OCTETS, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.types import Message

HEADER = b"\x00\x01\x00\x00"  # little-endian CDR, no options
_LITTLE_ENDIAN = HEADER[:2]
MOST_ELEMENTS = 1_000_000  # in a sequence of strings or messages, which take far more room in memory than on the wire
MOST_TRAILING = 16  # bytes that writers such as Fast DDS add to fill the last words
# rclpy's `serialize_message` adds up to four more for each empty list of 64-bit numbers: never more than the message.

_CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
_COUNT = struct.Struct("<I")

M = TypeVar("M", bound=Message)


class CdrError(ValueError):
    """Raised when bytes are not the expected message, or when a message has a value that cannot be written."""


class CdrLengthError(CdrError):
    """Raised when there are fewer or more bytes than the message needs."""


class CdrLimitError(CdrError):
    """Raised when the lists of a message have more entries than its reader takes."""


def encode(message: Message) -> bytes:
    """Return the message as CDR with its header.

    Raises:
        CdrError: if a value has the wrong type or is out of range.
    """
    try:
        layout = _layout(type(message))
        if layout.fixed is not None:
            return HEADER + layout.fixed.pack(*layout.numbers(message))
        out = bytearray(HEADER)
        layout.write(message, out)
    except (struct.error, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise CdrError(f"{message.TYPE} cannot be written: {error}") from error
    return bytes(out)


def decode(message: type[M], payload: bytes | bytearray | memoryview, most: float = math.inf) -> M:
    """Return the message of class `message` in `payload`.

    Its lists of texts and messages may have at most `most` entries in all: each costs some 10 µs. They are counted
    before they are read. Arrays of numbers cost next to nothing and do not count.

    Raises:
        CdrLimitError: if there are more entries.
        CdrError: if the payload is anything else, too short or too long.
    """
    layout = _layout(message)
    # Messages of only numbers, as most frequent ones are, take two thirds of the time without the steps below.
    if layout.fixed is not None and len(payload) == layout.size and payload[:2] == _LITTLE_ENDIAN:
        made: M = layout.build(layout.fixed.unpack_from(payload, len(HEADER)))
        return made
    data = _Payload(payload)
    data.left = most
    values: list[M] = []
    try:
        if len(data) < len(HEADER) or data[:2] != HEADER[:2]:
            raise CdrError("no little-endian CDR header")
        end = layout.read(data, len(HEADER), values)
        if len(data) - end > (MOST_TRAILING if layout.fixed else max(MOST_TRAILING, end - len(HEADER))):
            raise CdrLengthError(f"{len(data) - end} bytes too many")
    except (struct.error, CdrLengthError) as error:
        raise CdrLengthError(f"no {message.TYPE}: {error}") from error
    except CdrLimitError:
        raise CdrLimitError(f"{message.TYPE} with more than {most} entries") from None
    except (UnicodeDecodeError, CdrError) as error:
        raise CdrError(f"no {message.TYPE}: {error}") from error
    return values[0]


class _Payload(bytes):
    """The bytes of a message, and how many entries of lists may still be read from them."""

    left: float


class _Codec(Protocol):
    """Writes one value, and reads one, appending it to a list."""

    least: int  # minimum bytes of a value

    def write(self, value: Any, out: bytearray) -> None: ...

    def read(self, data: _Payload, at: int, values: list[Any]) -> int: ...


class _Numbers:
    """A run of single numbers, each a value of its own: a `struct` for each alignment of its start."""

    def __init__(self, types: tuple[str, ...]) -> None:
        codes = [_CODES[type_] for type_ in types]
        self.least = sum(map(struct.calcsize, codes))
        self._structs = [struct.Struct(_aligned(codes, phase)) for phase in range(8)]
        self.first = self._structs[0]  # for a run at the start of the message

    def write(self, value: Any, out: bytearray) -> None:
        out += self._structs[(len(out) - len(HEADER)) & 7].pack(*value)

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        layout = self._structs[(at - len(HEADER)) & 7]
        values += layout.unpack_from(data, at)
        return at + layout.size


class _Nothing:
    """A message without fields: one byte without meaning."""

    least = 1

    def write(self, value: Any, out: bytearray) -> None:
        out.append(0)

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        if at >= len(data):
            raise CdrLengthError("it ends too early")
        return at + 1


class _Text:
    """A string: its length including the final zero byte, then UTF-8."""

    least = 4

    def __init__(self, limit: int) -> None:
        self._limit = limit

    def write(self, value: Any, out: bytearray) -> None:
        text = value.encode()
        if self._limit and len(text) > self._limit:
            raise CdrError(f"a text of {len(text)} bytes, at most {self._limit} are allowed")
        out += bytes(-len(out) % 4) + _COUNT.pack(len(text) + 1) + text + b"\0"

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        at += -at % 4
        (length,) = _COUNT.unpack_from(data, at)
        start, end = at + 4, at + 4 + int(length)
        if end > len(data) or (end > start and data[end - 1]):
            raise CdrError("a text has no end")
        if self._limit and end - start > self._limit + 1:
            raise CdrError(f"a text is longer than {self._limit} bytes")
        values.append(data[start : end - 1].decode() if end > start else "")
        return end


class _Many:
    """Base of arrays and sequences: a count unless it is fixed, checked when writing and reading."""

    def __init__(self, type_: FieldType, size: int = 1) -> None:
        self._type = type_
        self._size = size  # minimum bytes of an element
        self.least = type_.length * size if type_.shape is FieldShape.ARRAY else 4

    def _write_count(self, count: int, out: bytearray) -> None:
        self._check(count)
        if self._type.shape is not FieldShape.ARRAY:
            out += bytes(-len(out) % 4) + _COUNT.pack(count)

    def _read_count(self, data: _Payload, at: int) -> tuple[int, int]:
        count = self._type.length
        if self._type.shape is not FieldShape.ARRAY:
            at += -at % 4
            (count,) = _COUNT.unpack_from(data, at)
            at += 4
        self._check(count)
        if count * self._size > len(data) - at:
            raise CdrLengthError(f"{count} elements do not fit into {len(data) - at} bytes")
        return count, at

    def _check(self, count: int) -> None:
        shape, length = self._type.shape, self._type.length
        if (shape is FieldShape.ARRAY and count != length) or (shape is FieldShape.BOUNDED and count > length):
            raise CdrError(f"{count} elements where {self._type} is expected")


class _Octets(_Many):
    """Bytes."""

    def write(self, value: Any, out: bytearray) -> None:
        self._write_count(len(value), out)
        out += value

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        count, at = self._read_count(data, at)
        values.append(data[at : at + count])
        return at + count


class _Flags(_Many):
    """A tuple of truth values."""

    def write(self, value: Any, out: bytearray) -> None:
        self._write_count(len(value), out)
        if not _BOTH.issuperset(value):
            raise CdrError(f"{value!r} where {self._type} is expected")
        out += bytes(map(bool, value))

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        count, at = self._read_count(data, at)
        values.append(tuple(map(bool, data[at : at + count])))
        return at + count


_BOTH = frozenset((True, False))


class _Array(_Many):
    """A numpy array."""

    def __init__(self, type_: FieldType) -> None:
        super().__init__(type_, struct.calcsize(_CODES[type_.base]))
        self._dtype = f"<{_CODES[type_.base]}"

    def write(self, value: Any, out: bytearray) -> None:
        self._write_count(value.size, out)
        if value.size:
            out += bytes((len(HEADER) - len(out)) % self._size) + value.tobytes()

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        count, at = self._read_count(data, at)
        if count:
            at += (len(HEADER) - at) % self._size
            if count * self._size > len(data) - at:
                raise CdrLengthError("an array ends too early")
        values.append(np.frombuffer(data, self._dtype, count, at if count else 0))
        return at + count * self._size


class _Elements(_Many):
    """A tuple of texts or messages."""

    def __init__(self, type_: FieldType, element: _Codec) -> None:
        super().__init__(type_, element.least)
        self._element = element

    def write(self, value: Any, out: bytearray) -> None:
        if isinstance(value, str):  # which has texts as elements, too
            raise CdrError(f"the text {value!r} where {self._type} is expected")
        self._write_count(len(value), out)
        for element in value:
            self._element.write(element, out)

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        count, at = self._read_count(data, at)
        if self._type.shape is not FieldShape.ARRAY:
            data.left -= count
            if data.left < 0:
                raise CdrLimitError
        elements: list[Any] = []
        for _ in range(count):
            at = self._element.read(data, at, elements)
        values.append(tuple(elements))
        return at

    def _check(self, count: int) -> None:
        super()._check(count)
        if count > MOST_ELEMENTS:
            raise CdrError(f"{count} elements, at most {MOST_ELEMENTS} are allowed")


class _Layout:
    """The codec of a class: steps over all its values, including nested ones, and how to build it from them."""

    def __init__(self, message: type[Message]) -> None:
        self._steps: list[tuple[Callable[[Any], Any], _Codec]] = []
        self._numbers: list[tuple[str, str]] = []  # path and type of the numbers without a step so far
        self._count = 0  # number of values
        self._names: dict[str, Any] = {}  # names that the generated function uses
        self._lines: list[str] = []
        made = self._add(message, "")
        self._end_numbers()
        # A generated function takes a third of the time of walking over the classes for each message.
        body = "\n    ".join([*self._lines, f"return {made}"])
        exec(f"def build(v):\n    {body}", self._names)  # noqa: S102
        self.build: Callable[[Sequence[Any]], Any] = self._names["build"]
        self.least = sum(codec.least for _, codec in self._steps)
        only = self._steps[0][1] if len(self._steps) == 1 else None
        self.fixed = only.first if isinstance(only, _Numbers) else None  # None unless the message has only numbers
        self.size = len(HEADER) + (self.fixed.size if self.fixed else 0)  # [B] of such a message
        self.numbers = self._steps[0][0]  # those of such a message

    def write(self, value: Any, out: bytearray) -> None:
        for get, codec in self._steps:
            codec.write(get(value), out)

    def read(self, data: _Payload, at: int, values: list[Any]) -> int:
        mine: list[Any] = []
        for _, codec in self._steps:
            at = codec.read(data, at, mine)
        values.append(self.build(mine))
        return at

    def _add(self, message: type[Message], prefix: str) -> str:
        """Add the steps of a message and return the expression that builds it from the values `v`."""
        if not message.FIELDS:
            self._add_step(lambda value: value, _Nothing())
        arguments = [
            self._add_field(message, parse_type(text), prefix + attribute(name))
            for name, text in message.FIELDS.items()
        ]
        return self._add_making(message, arguments)

    def _add_making(self, message: type[Message], arguments: list[str]) -> str:
        """Add the lines that make one message and return its name in them."""
        number = len(self._lines)
        made, maker = f"m{number}", f"c{number}"
        if issubclass(message, ArrayMessage):
            self._names[maker] = message
            self._lines.append(f"{made} = {maker}({', '.join(arguments)})")
            return made
        # Use the setters of the slots, since the `__init__` of a frozen class takes twice as long.
        self._names[maker] = partial(object.__new__, message)
        self._lines.append(f"{made} = {maker}()")
        for at, (name, value) in enumerate(zip(message.FIELDS, arguments, strict=True)):
            setter = f"s{number}_{at}"
            self._names[setter] = getattr(message, attribute(name)).__set__
            self._lines.append(f"{setter}({made}, {value})")
        return made

    def _add_field(self, message: type[Message], type_: FieldType, path: str) -> str:
        if type_.shape is FieldShape.SINGLE and type_.is_message:
            return self._add(registry.inside(message, type_.base), f"{path}.")
        if type_.shape is FieldShape.SINGLE and type_.base in _CODES:
            self._numbers.append((path, type_.base))
        else:
            self._add_step(attrgetter(path), _codec(message, type_))
        self._count += 1
        return f"v[{self._count - 1}]"

    def _add_step(self, get: Callable[[Any], Any], codec: _Codec) -> None:
        self._end_numbers()
        self._steps.append((get, codec))

    def _end_numbers(self) -> None:
        if self._numbers:
            paths, types = zip(*self._numbers, strict=True)
            self._numbers = []
            self._steps.append((_getter(paths, types), _Numbers(types)))


_layouts: dict[type[Message], _Layout] = {}


def _layout(message: type[Message]) -> _Layout:
    found = _layouts.get(message)
    if found is None:
        found = _layouts[message] = _Layout(message)
    return found


def _getter(paths: tuple[str, ...], types: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    get = attrgetter(*paths)
    all_of: Callable[[Any], tuple[Any, ...]] = get if len(paths) > 1 else lambda message: (get(message),)
    flags = [index for index, type_ in enumerate(types) if type_ == "bool"]

    def checked(message: Any) -> tuple[Any, ...]:
        values = all_of(message)
        for index in flags:
            if values[index] not in _BOTH:  # `struct` takes anything for one of them
                raise CdrError(f"{values[index]!r} where bool is expected")
        return values

    return checked if flags else all_of


def _codec(message: type[Message], type_: FieldType) -> _Codec:
    if holds_numbers(type_):
        return _Array(type_)
    if type_.base in OCTETS:
        return _Octets(type_)
    if type_.base == "bool":
        return _Flags(type_)
    element: _Codec = _layout(registry.inside(message, type_.base)) if type_.is_message else _Text(type_.text_limit)
    return element if type_.shape is FieldShape.SINGLE else _Elements(type_, element)


def _aligned(codes: list[str], phase: int) -> str:
    """Return the format of these numbers for a start `phase` bytes after a multiple of eight."""
    format_, at = "<", phase
    for code in codes:
        size = struct.calcsize(code)
        padding = -at % size
        format_ += f"{padding}x{code}"
        at += padding + size
    return format_
