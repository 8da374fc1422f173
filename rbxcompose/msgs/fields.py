"""Fields of messages: their paths, what they measure, parallel arrays as maps, finite numbers."""

from collections.abc import Callable, Collection, Mapping
from math import inf, isfinite
from operator import attrgetter
from typing import Any

from rbxcompose.base import units
from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs import registry
from rbxcompose.msgs.arrays import holds_numbers
from rbxcompose.msgs.definitions import FLOATS, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.types import Message


class NoFieldError(Exception):
    """Raised when a message has no field of a name; `fields` are those of the message `message`."""

    def __init__(self, message: str, name: str, fields: Collection[str]) -> None:
        super().__init__(f"{message} has no field '{name}'")
        self.message = message
        self.name = name
        self.fields = fields


def field_type(message: str, path: str) -> FieldType:
    """Return the type of a field of a message; a field of a field is written with a dot.

    Raises:
        NoFieldError: if there is none.
    """
    first, *others = path.split(".")
    fields = registry.message(message).FIELDS
    if first not in fields:
        raise NoFieldError(message, first, fields)
    found = parse_type(fields[first])
    if not others:
        return found
    if not found.is_message or found.shape is not FieldShape.SINGLE:
        raise NoFieldError(str(found), others[0], ())
    return field_type(found.base, ".".join(others))


Measures = Mapping[str, "units.Dimension | Measures | None"]
"""What numbers of a message measure, by field: a map for a nested message, None for what depends on other fields."""
_GEOMETRY = "geometry_msgs/msg/"
_MEASURES: Mapping[tuple[str, str], units.Dimension] = {
    (f"{_GEOMETRY}Twist", "linear"): units.SPEED,
    (f"{_GEOMETRY}Twist", "angular"): units.ANGULAR_SPEED,
    (f"{_GEOMETRY}Accel", "linear"): units.ACCELERATION,
    (f"{_GEOMETRY}Accel", "angular"): units.ANGULAR_ACCELERATION,
    (f"{_GEOMETRY}Wrench", "force"): units.FORCE,
    (f"{_GEOMETRY}Wrench", "torque"): units.TORQUE,
    (f"{_GEOMETRY}Pose", "position"): units.LENGTH,
    (f"{_GEOMETRY}Transform", "translation"): units.LENGTH,
    **{(f"{_GEOMETRY}Point", axis): units.LENGTH for axis in "xyz"},
}


def measure_of(message: str, field: str) -> units.Dimension | None:
    """Return what a field of a message, and all below it, measures; None if that is not known."""
    return _MEASURES.get((message, field))


_NAMES, _VALUES = ("string[]",), ("float32[]", "float64[]")


@dataclass(frozen=True, slots=True)
class ArrayEntries:
    """Arguments of a skill that are entries of two arrays: a name, and a number in SI.

    `names` and `values` are the fields, `each` is what is measured by each name. An argument may be left out, but one
    of them must be given, or the field `instead`. A field of the message with the name of an entry takes precedence.
    """

    names: str
    values: str
    each: Mapping[str, units.Dimension]
    instead: str = ""

    def require_in(self, message: type[Message]) -> None:
        """Do nothing if a message has these arrays.

        Raises:
            ValueError: if it has not.
        """
        for field, types in ((self.names, _NAMES), (self.values, _VALUES)):
            if message.FIELDS.get(field) not in types:
                raise ValueError(f"{message.TYPE} has no field '{field}' of type {' or '.join(types)}")

    def arrays(self, given: Mapping[str, object]) -> dict[str, object]:
        """Return both fields with the entries that are given, in their order."""
        return {self.names: tuple(given), self.values: tuple(given.values())}


@dataclass(frozen=True, slots=True)
class NumberRange:
    """What a number may be, in SI: at least `least`, or above it if the range `is_open`, and at most `greatest`."""

    least: float = 0.0
    greatest: float = inf
    is_open: bool = False

    def holds(self, value: float) -> bool:
        """Return whether a number is within it."""
        return value <= self.greatest and (value > self.least or (value == self.least and not self.is_open))

    def phrase(self, show: Callable[[float], str]) -> str:
        """Return it in words, as `show` writes numbers."""
        words = f"{'above' if self.is_open else 'at least'} {show(self.least)}"
        return words if self.greatest == inf else f"{words} and at most {show(self.greatest)}"


Get = Callable[[Any], Any]
Test = Callable[[Any], bool]
Tests = tuple[tuple[Get, Test], ...]


class NotFiniteError(ValueError):
    """Raised when a number of a command is NaN or infinite."""


def is_finite(message: Message) -> bool:
    """Return whether `message` contains neither NaN nor an infinity, at any depth."""
    tests = _tests.get(type(message))
    if tests is None:
        tests = _tests[type(message)] = _tests_of(type(message))
    for get, test in tests:  # noqa: SIM110 - a generator takes twice as long
        if not test(get(message)):
            return False
    return True


def require_finite(message: Message) -> None:
    """Do nothing if all numbers of `message` are finite.

    Raises:
        NotFiniteError: if one is not.
    """
    if not is_finite(message):
        raise NotFiniteError(f"a number in {message.TYPE} is not finite")


def require_type(message: object, wanted: type[Message], name: str) -> None:
    """Do nothing if `message` has the type that `name` takes; another class of the same type will do.

    Raises:
        TypeError: if it has not.
    """
    given = getattr(type(message), "TYPE", type(message).__name__)
    if given != wanted.TYPE:
        raise TypeError(f"'{name}' takes {wanted.TYPE}, not {given}")


_tests: dict[type[Message], Tests] = {}


def _tests_of(message: type[Message]) -> Tests:
    """Return the values to check and their tests; all single numbers, even of nested messages, share one test."""
    singles: list[str] = []
    others: list[tuple[Get, Test]] = []
    _collect(message, "", singles, others)
    if len(singles) == 1:
        others.append((attrgetter(*singles), isfinite))
    elif singles:
        others.append((attrgetter(*singles), _all_finite))
    return tuple(others)


def _collect(message: type[Message], prefix: str, singles: list[str], others: list[tuple[Get, Test]]) -> None:
    for name, text in message.FIELDS.items():
        type_, path = parse_type(text), prefix + attribute(name)
        if type_.shape is FieldShape.SINGLE and type_.is_message:
            _collect(registry.inside(message, type_.base), f"{path}.", singles, others)
        elif type_.shape is FieldShape.SINGLE and type_.base in FLOATS:
            singles.append(path)
        elif type_.shape is not FieldShape.SINGLE and (test := _test_of_many(type_)) is not None:
            others.append((attrgetter(path), test))


def _test_of_many(type_: FieldType) -> Test | None:
    if type_.is_message:
        return lambda values: all(map(is_finite, values))
    return _is_finite_array if holds_numbers(type_) and type_.base in FLOATS else None


def _all_finite(values: tuple[float, ...]) -> bool:
    return isfinite(sum(values)) or all(map(isfinite, values))  # the sum of finite numbers may not be finite


def _is_finite_array(values: Any) -> bool:
    return bool(np.isfinite(values).all())
