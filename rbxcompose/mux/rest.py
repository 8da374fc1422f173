"""Messages that command rest: zeros, where the type or the receiver says that zeros are rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any

from rbxcompose.msgs.arrays import holds_numbers, zeros
from rbxcompose.msgs.definitions import FLOATS, INTEGERS, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.types import Message

VELOCITIES = (Twist.TYPE, TwistStamped.TYPE)
"""Types whose zero is rest by their definition. A zero position, pose or flag is a command like any other."""


def zeroed(message: Message) -> Message:
    """Return a message of the same shape whose numbers are zero; headers, flags and texts stay."""
    changed = {name: _zero(value) for name, value in _numbers(message)}
    return replace(message, **changed)  # type: ignore[type-var]


def is_zeroed(message: Message) -> bool:
    """Return whether all numbers of a message are zero."""
    return all(_is_zero(value) for _, value in _numbers(message))


def rest_of(message: type[Message]) -> Callable[[Message | None], Message]:
    """Return what makes the message of rest from the last one that came through, or from none."""
    empty = message()
    return lambda last: empty if last is None else zeroed(last)


def _numbers(message: Message) -> Iterator[tuple[str, Any]]:
    kind: Any = type(message)  # mypy considers classes of a generic not hashable
    for name in _names(kind):
        yield name, getattr(message, name)


@cache
def _names(message: type[Message]) -> tuple[str, ...]:
    """Return the fields with numbers: numbers, arrays of them, messages, rows of messages."""
    return tuple(attribute(name) for name, text in message.FIELDS.items() if _has_numbers(parse_type(text)))


def _has_numbers(type_: FieldType) -> bool:
    is_number = type_.base in (*FLOATS, *INTEGERS)
    is_plain = is_number and (type_.shape is FieldShape.SINGLE or holds_numbers(type_))
    return is_plain or (type_.is_message and type_.base != Header.TYPE)


def _zero(value: Any) -> Any:
    if isinstance(value, Message):
        return zeroed(value)
    if isinstance(value, tuple | list):
        return tuple(map(zeroed, value))
    return zeros(value.dtype.name, value.size) if hasattr(value, "dtype") else type(value)(0)


def _is_zero(value: Any) -> bool:
    if isinstance(value, Message):
        return is_zeroed(value)
    if isinstance(value, tuple | list):
        return all(map(is_zeroed, value))
    return not (value.any() if hasattr(value, "dtype") else value)
