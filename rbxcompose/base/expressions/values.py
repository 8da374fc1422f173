"""Data of an evaluation: values, functions of them, the scope that has them, and the errors that may end it."""

import math
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Final, Protocol, TypeAlias, TypeGuard, runtime_checkable

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.units import MOST

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

    @property
    def y(self) -> float:
        """Return y in `map` [m]."""


@runtime_checkable
class NamedPose(Located, Protocol):
    """A pose with a name."""

    @property
    def name(self) -> str:
        """Return the name that missions use."""

    @property
    def heading(self) -> float:
        """Return the heading in `map` [rad]."""


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
    """What is known while the robot runs; a subclass knows what it overrides, and nothing else."""

    def variable(self, name: str) -> Value | NotArrived:
        """Return the value of `$name`; raise KeyError if there is no such name."""
        raise KeyError(name)

    def word(self, name: str) -> Value:
        """Return what a bare word names: a place, else (a choice, a result) its own text; raise KeyError if nothing."""
        raise KeyError(name)

    def age(self, name: str) -> float | NotArrived:
        """Return the time since the last message of `$name` [s]; raise KeyError if there is no such name."""
        raise KeyError(name)

    def is_new(self, name: str) -> bool:
        """Return whether a message of `$name` came since this node started; raise KeyError if there is no such name."""
        raise KeyError(name)


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


@dataclass(frozen=True, slots=True)
class Function:
    """A function: it takes `least` to `most` arguments; `compute` raises ValueError in plain words.

    Without `compute`, it asks the scope about a `$name`. `form` shows how it is written, `about` what it returns.
    """

    least: int
    most: int
    form: str
    about: str
    compute: Callable[..., Value] | None = None

    def wrong_count(self, given: int) -> str:
        """Return what is wrong with this number of arguments, or nothing."""
        if self.least <= given <= self.most:
            return ""
        takes = f"{self.least}" if self.least == self.most else f"at least {self.least}"
        return f"takes {takes} argument{'' if self.least == 1 else 's'}, not {given}"


def items(value: Value) -> list[Value]:
    """Return the items of a list, or the keys of a map.

    Raises:
        ValueError: if it is neither, or has too many.
    """
    if not isinstance(value, list | tuple | Mapping):
        raise ValueError("needs a list or a map")
    if len(value) > MOST_ITEMS:
        raise ValueError(f"takes a list of at most {MOST_ITEMS:,} items")
    return list(value)


def _count(value: Value) -> float:
    if not isinstance(value, list | tuple | Mapping):
        raise ValueError("needs a list or a map")
    return float(len(value))


def _distance(value: Value, other: Value) -> float:
    if not (is_located(value) and is_located(other)):
        raise ValueError("needs two places or poses")
    return math.hypot(value.x - other.x, value.y - other.y)


def _least(*values: Value) -> float:
    return min(_numbers(values))


def _greatest(*values: Value) -> float:
    return max(_numbers(values))


def _numbers(values: tuple[Value, ...]) -> list[float]:
    numbers = [_number(value) for value in (values if len(values) > 1 else items(values[0]))]
    if not numbers:
        raise ValueError("needs a list that is not empty")
    return numbers


def _number(value: Value) -> float:
    if isinstance(value, float) and value == value:
        return value
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) < MOST:
        return float(value)
    raise ValueError("needs numbers")


def _rounded(value: Value) -> float:
    """Round to a whole number, halves away from zero as people do."""
    number = _number(value)
    if math.isinf(number):
        raise ValueError("needs a finite number")
    whole = float(math.trunc(number))
    return whole + math.copysign(1.0, number) if abs(number - whole) >= 0.5 else whole


_MANY = 1000  # no expression is long enough to have more

FOREIGN: Mapping[str, str] = {
    "range": "to do something a number of times, write 'repeat: 3'; a list is written '[1, 2, 3]'",
    "enumerate": "a loop over a list gives its items only",
    **dict.fromkeys(("len", "size", "length"), "write 'count(...)'"),
    **dict.fromkeys(("int", "float", "str"), "values need no conversion; 'round(...)' gives a whole number"),
    **dict.fromkeys(("dist", "norm", "hypot"), "write 'distance(a, b)'"),
}
"""Functions of other languages, and what to write instead."""
FUNCTIONS: Mapping[str, Function] = {
    "count": Function(1, 1, "count(list)", "How many items a list has, or entries a map.", _count),
    "age": Function(1, 1, "age($name)", "The time since the last message of a value."),
    "new": Function(
        1, 1, "new($name)", "Whether a message arrived since its node started; in an interrupt, since it last acted."
    ),
    "distance": Function(2, 2, "distance(a, b)", "The length between two places or poses.", _distance),
    "min": Function(1, _MANY, "min(a, b, ...)", "The smallest of several values, or of one list.", _least),
    "max": Function(1, _MANY, "max(a, b, ...)", "The largest of several values, or of one list.", _greatest),
    "abs": Function(1, 1, "abs(x)", "A number or quantity without its sign.", lambda value: abs(_number(value))),
    "round": Function(1, 1, "round(x)", "The nearest whole number, halves away from zero; of a bare number.", _rounded),
}
