"""The functions of the expression language: all of them, with their number of arguments and what they compute."""

import math
from collections.abc import Callable, Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import MOST_ITEMS, Value, is_located
from rbxcompose.base.units import MOST


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


def _absolute(value: Value) -> float:
    return abs(_number(value))


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
    "abs": Function(1, 1, "abs(x)", "A number or quantity without its sign.", _absolute),
    "round": Function(1, 1, "round(x)", "The nearest whole number, halves away from zero; of a bare number.", _rounded),
}
