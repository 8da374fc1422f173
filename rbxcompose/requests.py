"""Requests that people and tools may send to a running robot: typed, each with the type of its answer.

A request is a frozen dataclass. Whoever handles it marks a method with `answers`; `answering` finds all of these.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, ClassVar, Generic, TypeVar, get_args

from rbxcompose.typed_json import Family

A = TypeVar("A")
Taker = TypeVar("Taker")
Taken = TypeVar("Taken")
_MARK = "__answers__"


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

    @property
    def words(self) -> str:
        """Return the request in a person's words, for the log."""
        return type(self).__name__


class Command(Request[str]):
    """Something to do; the answer is a sentence for people."""


class Query(Request[A]):
    """A question that changes nothing and may be repeated at will."""


Requests = Family[Request[Any]]


def requests(*types: type[Request[Any]]) -> Requests:
    """Return the requests that something accepts."""
    return Family(types, lambda one: one.name())


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
