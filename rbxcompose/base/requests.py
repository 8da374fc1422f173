"""Requests to a running robot and other frozen dataclasses as plain data for JSON, and back."""

import inspect
import json
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, ClassVar, Generic, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")
TYPE = "type"  # the key that holds the name of the type


class UnreadableError(ValueError):
    """Raised for data that does not have the wanted shape; its text says where and why."""

    def __init__(self, problem: str, *path: str) -> None:
        super().__init__(f"'{'.'.join(path)}' {problem}" if path else problem)
        self.problem, self.path = problem, path


def to_data(value: object) -> Any:
    """Return a value as plain data: a dataclass becomes a dict by field, in the order of its fields."""
    return [to_data(item) for item in value] if isinstance(value, tuple | list) else _plain(value)


def _plain(value: Any) -> Any:
    """Return what `dataclasses.asdict` makes of a value, without a copy of all that cannot change."""
    cls = type(value)
    if is_dataclass(cls):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(cls)}
    if cls in (list, tuple):
        return cls(map(_plain, value))
    return {key: _plain(entry) for key, entry in value.items()} if cls is dict else value


def from_data(wanted: Any, data: Any) -> Any:
    """Return the value of type `wanted` that plain data represents.

    `wanted` is a dataclass, a scalar, an enumeration, `Any`, or a union, sequence, tuple or mapping of these.

    Raises:
        UnreadableError: if the data has another shape.
    """
    origin, arguments = get_origin(wanted), get_args(wanted)
    if wanted is Any:
        return data
    if wanted in _SCALARS:
        return _checked(data, *_SCALARS[wanted])
    if origin in (Union, UnionType):
        return _first(arguments, data)
    if origin is None:
        return _members(wanted, data) if issubclass(wanted, Enum) else _fields(wanted, data)
    if issubclass(origin, Mapping):
        return {key: _at(key, arguments[1], entry) for key, entry in _checked(data, *_OBJECT).items()}
    items = _checked(data, (list, tuple), "is not a list")
    if origin is tuple and arguments[-1] is not Ellipsis:
        if len(items) != len(arguments):
            raise UnreadableError(f"is not a list of {len(arguments)}")
        return tuple(_at(str(index), *pair) for index, pair in enumerate(zip(arguments, items, strict=True)))
    made = list if origin is list else tuple
    return made(_at(str(index), arguments[0], item) for index, item in enumerate(items))


class Family(Generic[T]):
    """Dataclasses distinguished by a name stored beside their fields."""

    def __init__(self, types: Iterable[type[T]], name_of: Callable[[type[T]], str] = lambda one: one.__name__) -> None:
        self._name_of = name_of
        self.types: Mapping[str, type[T]] = {name_of(cls): cls for cls in types}

    def to_data(self, value: T) -> dict[str, Any]:
        """Return the name and the fields of a value."""
        return {TYPE: self._name_of(type(value)), **to_data(value)}

    def from_data(self, data: object) -> T:
        """Return the value that data represents.

        Raises:
            UnreadableError: if the name is unknown, or the fields do not fit.
        """
        name = name_in(data)
        if name not in self.types or not isinstance(data, dict):
            raise UnreadableError(f"'{name}' is not known here")
        value: T = from_data(self.types[name], {key: entry for key, entry in data.items() if key != TYPE})
        return value

    def to_line(self, value: T) -> bytes:
        """Return a value as one line of JSON."""
        return json.dumps(self.to_data(value)).encode() + b"\n"

    def from_line(self, line: bytes) -> T:
        """Read what `to_line` wrote; raise as `from_data` does."""
        return self.from_data(json.loads(line))


def name_in(data: object) -> str:
    """Return the type name in data; empty if it has none."""
    name = data.get(TYPE) if isinstance(data, dict) else None
    return name if isinstance(name, str) else ""


_OBJECT = (dict,), "is not an object"
_SCALARS: Mapping[Any, tuple[tuple[type, ...], str]] = {
    str: ((str,), "is not text"),
    bool: ((bool,), "is neither true nor false"),
    int: ((int,), "is not a whole number"),
    float: ((float, int), "is not a number"),
    NoneType: ((NoneType,), "is not null"),
}


def _checked(data: Any, types: tuple[type, ...], problem: str) -> Any:
    if type(data) not in types:  # a bool is not an int here
        raise UnreadableError(problem)
    return data


def _at(place: str, wanted: Any, data: Any) -> Any:
    try:
        return from_data(wanted, data)
    except UnreadableError as error:
        raise UnreadableError(error.problem, place, *error.path) from None


def _first(wanted: Sequence[Any], data: Any) -> Any:
    """Return the value read as the first type that fits."""
    if data is None and NoneType in wanted:
        return None
    for one in wanted:
        try:
            return from_data(one, data)
        except UnreadableError as error:
            problem = error
    raise problem


def _members(wanted: type[Enum], data: Any) -> Enum:
    try:
        return wanted(data)
    except ValueError:
        raise UnreadableError(f"is not one of {', '.join(str(item.value) for item in wanted)}") from None


def _fields(wanted: Any, data: Any) -> Any:
    hints, needed = _shape(wanted)
    given = _checked(data, *_OBJECT)
    if unknown := next((key for key in given if key not in hints), None):
        raise UnreadableError("is not known here", unknown)
    if missing := next((key for key in needed if key not in given), None):
        raise UnreadableError("is missing", missing)
    return wanted(**{key: _at(key, hints[key], entry) for key, entry in given.items()})


@cache
def _shape(wanted: Any) -> tuple[Mapping[str, Any], Sequence[str]]:
    """Return the types of a dataclass's fields, and the names of those without a default."""
    hints = get_type_hints(wanted)
    needed = [field.name for field in fields(wanted) if field.default is MISSING and field.default_factory is MISSING]
    return {field.name: hints[field.name] for field in fields(wanted)}, needed


A = TypeVar("A")
Taker = TypeVar("Taker")
Taken = TypeVar("Taken")
_MARK = "__answers__"


class OutsideError(Exception):
    """Raised by a component that cannot go on for a reason outside of its code; the text says which, in plain words."""


class Refused(Exception):  # noqa: N818 - it is an answer, not an error of ours
    """Raised to refuse a request or a command; its text is the reason."""


class Request(Generic[A]):
    """A request whose answer is an `A`; subclass `Command` or `Query`."""

    about: ClassVar[str]
    """Its subject; findings name this as the type of its receiver."""

    @classmethod
    def name(cls) -> str:
        """Return the name that identifies the request between processes."""
        return f"{cls.about}.{cls.__name__}"

    @classmethod
    def answer_type(cls) -> Any:
        """Return the type of the answer."""
        generics = [base for one in inspect.getmro(cls) for base in one.__dict__.get("__orig_bases__", ())]
        found = (argument for base in generics for argument in get_args(base) if not isinstance(argument, TypeVar))
        return next(found)

    written: ClassVar[str] = ""
    """How it is written on the command line, with fields in braces: `scene remove {0.object}`."""

    @property
    def words(self) -> str:
        """Return the request in a person's words, for the log."""
        return shlex.join(word.format(self) for word in self.written.split()) or type(self).__name__


class Command(Request[str]):
    """Something to do; the answer is a sentence for people."""


class Query(Request[A]):
    """A question that changes nothing and may be repeated at will."""


Requests = Family[Request[Any]]


def requests(*types: type[Request[Any]]) -> Requests:
    """Return the requests that something accepts."""
    return Family(types, lambda cls: cls.name())


def as_data(request: Request[Any]) -> dict[str, Any]:
    """Return a request as data, with its name."""
    return requests(type(request)).to_data(request)


def answers(request: type[Request[A]]) -> Callable[[Callable[[Taker, Taken], A]], Callable[[Taker, Taken], A]]:
    """Mark the method that handles a type of request: it takes one and returns the answer, or raises `Refused`."""

    def mark(method: Callable[[Taker, Taken], A]) -> Callable[[Taker, Taken], A]:
        setattr(method, _MARK, request)
        return method

    return mark


def answering(cls: type) -> Mapping[type[Request[Any]], str]:
    """Return the names of the methods of a class that handle requests, by type of request."""
    return _answering(cls)


@cache
def _answering(cls: type) -> Mapping[type[Request[Any]], str]:
    methods = inspect.getmembers(cls, inspect.isfunction)
    return {getattr(method, _MARK): name for name, method in methods if hasattr(method, _MARK)}
