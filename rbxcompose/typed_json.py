"""Frozen dataclasses as plain data for JSON, and back.

What comes from outside is not trusted: data that do not have the shape of the wanted type raise `UnreadableError`,
which names the place.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, asdict, fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, Generic, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")
TYPE = "type"  # the key that tells types apart

_Read = Callable[[Any], Any]


class UnreadableError(ValueError):
    """Raised for data that do not have the wanted shape; its text says where and why."""

    def __init__(self, problem: str, *path: str) -> None:
        super().__init__(f"'{'.'.join(path)}' {problem}" if path else problem)
        self.problem, self.path = problem, path


def to_data(value: object) -> Any:
    """Return plain data: of a dataclass a dict by field, in the order of its fields."""
    match value:
        case tuple() | list():
            return [to_data(one) for one in value]
        case _ if is_dataclass(value) and not isinstance(value, type):
            return asdict(value)
    return value


def from_data(wanted: Any, data: object) -> Any:
    """Return the value of type `wanted` that plain data stand for.

    `wanted` is a dataclass, a scalar, an enumeration, `Any`, or a union, sequence, tuple or mapping of such.

    Raises:
        UnreadableError: if the data have another shape.
    """
    return _reader(wanted)(data)


class Family(Generic[T]):
    """Dataclasses that are told apart by a name beside their fields."""

    def __init__(self, types: Iterable[type[T]], name_of: Callable[[type[T]], str] = lambda one: one.__name__) -> None:
        self._name_of = name_of
        self.types: Mapping[str, type[T]] = {name_of(one): one for one in types}

    def to_data(self, value: T) -> dict[str, Any]:
        """Return the name and the fields of a value."""
        return {TYPE: self._name_of(type(value)), **to_data(value)}

    def from_data(self, data: object) -> T:
        """Return the value that data stand for.

        Raises:
            UnreadableError: if the name is not known, or the fields do not fit.
        """
        name = name_in(data)
        if name not in self.types or not isinstance(data, dict):
            raise UnreadableError(f"'{name}' is not known here")
        value: T = from_data(self.types[name], {key: one for key, one in data.items() if key != TYPE})
        return value

    def to_line(self, value: T) -> bytes:
        """Return a value as one line of JSON."""
        return json.dumps(self.to_data(value)).encode() + b"\n"

    def from_line(self, line: bytes) -> T:
        """Read what `to_line` wrote; raise as `from_data` does."""
        return self.from_data(json.loads(line))


def name_in(data: object) -> str:
    """Return the name that data have; empty if they have none."""
    name = data.get(TYPE) if isinstance(data, dict) else None
    return name if isinstance(name, str) else ""


@cache
def _reader(wanted: Any) -> _Read:
    """Return what reads data of a type."""
    origin, arguments = get_origin(wanted), get_args(wanted)
    if wanted is Any or wanted is object:
        return lambda data: data
    if origin in (Union, UnionType):
        return _union(arguments)
    if origin is tuple and arguments[1:] != (Ellipsis,):
        return _tuple(arguments)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _mapping(_reader(arguments[1]))
    if isinstance(origin, type) and issubclass(origin, Sequence):
        return _sequence(list if origin is list else tuple, _reader(arguments[0]))
    if is_dataclass(wanted):
        return _dataclass(wanted)
    if issubclass(wanted, Enum):
        return _enum(wanted)
    return _scalar(wanted)


_SCALARS: Mapping[type, tuple[tuple[type, ...], str]] = {
    str: ((str,), "is no text"),
    bool: ((bool,), "is neither true nor false"),
    int: ((int,), "is no whole number"),
    float: ((float, int), "is no number"),
    NoneType: ((NoneType,), "is not null"),
}


def _scalar(wanted: type) -> _Read:
    taken, problem = _SCALARS[wanted]

    def read(data: Any) -> Any:
        if not isinstance(data, taken) or (isinstance(data, bool) and wanted is not bool):
            raise UnreadableError(problem)
        return data

    return read


def _enum(wanted: type[Enum]) -> _Read:
    def read(data: Any) -> Any:
        try:
            return wanted(data)
        except ValueError:
            raise UnreadableError(f"is none of {', '.join(str(one.value) for one in wanted)}") from None

    return read


def _union(wanted: Iterable[Any]) -> _Read:
    readers = [_reader(one) for one in wanted]

    def read(data: Any) -> Any:
        for one in readers:
            try:
                return one(data)
            except UnreadableError as error:
                problem = error
        raise problem

    return read


def _at(place: str, read: _Read, data: Any) -> Any:
    try:
        return read(data)
    except UnreadableError as error:
        raise UnreadableError(error.problem, place, *error.path) from None


def _sequence(made: Callable[[Iterable[Any]], Any], read_item: _Read) -> _Read:
    def read(data: Any) -> Any:
        if not isinstance(data, list | tuple):
            raise UnreadableError("is no list")
        return made(_at(str(index), read_item, one) for index, one in enumerate(data))

    return read


def _tuple(wanted: Sequence[Any]) -> _Read:
    readers = [_reader(one) for one in wanted]

    def read(data: Any) -> Any:
        if not isinstance(data, list | tuple) or len(data) != len(readers):
            raise UnreadableError(f"is no list of {len(readers)}")
        return tuple(_at(str(index), one, data[index]) for index, one in enumerate(readers))

    return read


def _mapping(read_value: _Read) -> _Read:
    def read(data: Any) -> Any:
        return {key: _at(str(key), read_value, one) for key, one in _object(data).items()}

    return read


def _dataclass(wanted: Any) -> _Read:
    hints = get_type_hints(wanted)
    readers = {one.name: _reader(hints[one.name]) for one in fields(wanted)}
    needed = [one.name for one in fields(wanted) if one.default is MISSING and one.default_factory is MISSING]

    def read(data: Any) -> Any:
        given = _object(data)
        if unknown := next((key for key in given if key not in readers), None):
            raise UnreadableError("is not known here", unknown)
        if missing := next((key for key in needed if key not in given), None):
            raise UnreadableError("is missing", missing)
        return wanted(**{key: _at(key, readers[key], one) for key, one in given.items()})

    return read


def _object(data: Any) -> Mapping[str, Any]:
    if not isinstance(data, dict):
        raise UnreadableError("is no object")
    return data
