"""Arrays of numbers in messages: read-only one-dimensional numpy arrays.

numpy is imported when the first such array is made, since most messages have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar

from rbxcompose.base.arrays import AnyArray, np
from rbxcompose.msgs.definitions import OCTETS, PRIMITIVES, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.types import Message

_NO_NUMBERS = ("bool", "string", *OCTETS)


@cache
def zeros(dtype: str, length: int) -> AnyArray:
    """Return a read-only array of zeros; the same one each time."""
    return _read_only(np.zeros(length), dtype)


def filled(dtype: str, values: tuple[Any, ...]) -> AnyArray:
    """Return a read-only array of these values."""
    return _read_only(values, dtype)


def holds_numbers(type_: FieldType) -> bool:
    """Return whether a field of this type is a numpy array."""
    return type_.shape is not FieldShape.SINGLE and type_.base in PRIMITIVES and type_.base not in _NO_NUMBERS


class ArrayMessage(Message):
    """A message with arrays of numbers: it accepts any sequence for them and keeps a read-only array.

    Raises:
        ValueError: if an array does not have the length that its type states.
    """

    __slots__ = ()
    ARRAYS: ClassVar[Mapping[str, FieldType]]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        types = {attribute(name): parse_type(text) for name, text in cls.FIELDS.items()}
        cls.ARRAYS = {name: type_ for name, type_ in types.items() if holds_numbers(type_)}

    def __post_init__(self) -> None:
        for name, type_ in self.ARRAYS.items():
            length = type_.length if type_.shape is FieldShape.ARRAY else 0
            given = getattr(self, name)
            if given is zeros(type_.base, length):
                continue  # the default
            array = _read_only(given, type_.base)
            if type_.shape is FieldShape.ARRAY and array.size != type_.length:
                raise ValueError(f"{name} of {self.TYPE} has {array.size} values, not {type_.length}")
            object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(self._is_same(other, attribute(name)) for name in self.FIELDS)

    def _is_same(self, other: object, name: str) -> bool:
        mine, theirs = getattr(self, name), getattr(other, name)
        return bool(np.array_equal(mine, theirs) if name in self.ARRAYS else mine == theirs)


def _read_only(values: Any, dtype: str) -> AnyArray:
    if isinstance(values, np.ndarray) and not values.flags.writeable and values.ndim == 1 and values.dtype == dtype:
        return values  # not even its creator can change it
    array = np.array(values, dtype).reshape(-1)
    array.flags.writeable = False
    return array
