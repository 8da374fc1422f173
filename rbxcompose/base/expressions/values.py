"""Data of an evaluation: values, the scope that has them, and the errors that may end it."""

from enum import Enum
from typing import Final, Protocol, TypeAlias, TypeGuard, runtime_checkable

LONGEST_TEXT = 4096  # characters
MOST_ITEMS = 1000  # in a list or a map
MOST_IN_ALL = 10_000  # items of nested lists, each counted as often as it is reached
MOST_LEVELS = 50  # of nested lists

Value: TypeAlias = object
"""A number in SI (float), bool, str, list, dict with text keys, or something opaque such as a place or a pose."""


class NotArrived(Enum):
    """The type of `NOT_ARRIVED`."""

    NOT_ARRIVED = "not arrived"


NOT_ARRIVED: Final = NotArrived.NOT_ARRIVED
"""Represents a value whose first message has not arrived."""


@runtime_checkable
class Located(Protocol):
    """Something with a position."""

    @property
    def x(self) -> float:
        """Return x in `map` [m]."""
        ...

    @property
    def y(self) -> float:
        """Return y in `map` [m]."""
        ...


@runtime_checkable
class NamedPose(Located, Protocol):
    """A pose with a name."""

    @property
    def name(self) -> str:
        """Return the name that missions use."""
        ...

    @property
    def heading(self) -> float:
        """Return the heading in `map` [rad]."""
        ...


_LOCATED: dict[type, bool] = {}
_NAMED: dict[type, bool] = {}


def is_located(value: Value) -> TypeGuard[Located]:
    """Return whether a value has a position; decided once for each class, since asking a protocol takes long."""
    known = _LOCATED.get(type(value))
    if known is None:
        known = _LOCATED[type(value)] = isinstance(value, Located)
    return known


def is_named_pose(value: Value) -> TypeGuard[NamedPose]:
    """Return whether a value is a place; decided once for each class, like `is_located`."""
    known = _NAMED.get(type(value))
    if known is None:
        known = _NAMED[type(value)] = isinstance(value, NamedPose)
    return known


class Scope(Protocol):
    """What is known while the robot runs."""

    def variable(self, name: str) -> Value | NotArrived:
        """Return the value of `$name`; raise KeyError if there is no such name."""
        ...

    def word(self, name: str) -> Value:
        """Return what a bare word names: a place, else (a choice, a result) its own text; raise KeyError if nothing."""
        ...

    def age(self, name: str) -> float | NotArrived:
        """Return the time since the last message of `$name` [s]; raise KeyError if there is no such name."""
        ...

    def is_new(self, name: str) -> bool:
        """Return whether a message of `$name` came since this node started; raise KeyError if there is no such name."""
        ...


class EvaluationError(Exception):
    """Raised when an expression has no value; `start` and `end` are offsets in its text."""

    def __init__(self, message: str, start: int, end: int) -> None:
        super().__init__(message)
        self.message = message
        self.start = start
        self.end = end


class NotArrivedError(Exception):
    """Raised when an evaluation needs a value that has not arrived yet."""

    def __init__(self, name: str) -> None:
        super().__init__(f"'${name}' has not arrived yet")
        self.name = name


def is_number(value: Value) -> TypeGuard[float]:
    """Return whether a value is a number; a flag is not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def is_same(value: Value, other: Value) -> bool:
    """Return whether two values are equal; a text equals the place of that name, and a flag equals no number."""
    if isinstance(value, str) != isinstance(other, str):
        text, thing = (value, other) if isinstance(value, str) else (other, value)
        return is_named_pose(thing) and thing.name == text
    return isinstance(value, bool) == isinstance(other, bool) and value == other
