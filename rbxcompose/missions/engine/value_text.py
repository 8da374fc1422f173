"""How values are written for people: with the unit of their type, places without underscores."""

import math
from collections.abc import Collection, Mapping

from rbxcompose.base.expressions.text import show_value
from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.base.expressions.values import Value, is_number
from rbxcompose.base.units import format_number, format_quantity

DIGITS = 3  # that people want to read of something measured


def show(type: Type | None, value: Value) -> str:
    """Return a value as text: '48.8889 %', 'living room', '2'."""
    dimension = (type or UNKNOWN).dimension
    if dimension and isinstance(value, int | float) and is_number(value):
        return format_quantity(value, dimension)
    return show_value("", value)


def spoken(value: Value, places: Collection[str]) -> Value:
    """Return a value with the names of places written as people say them: 'living room'."""
    match value:
        case str():
            return value.replace("_", " ") if value in places else value
        case list() | tuple():
            return [spoken(item, places) for item in value]
        case Mapping():
            return {str(spoken(name, places)): spoken(entry, places) for name, entry in value.items()}
    return value


def show_briefly(type: Type | None, value: Value) -> str:
    """Return a value as text, a number with three digits, or more if there are more before the point: '48.9 %'."""
    text = show(type, value)
    if not isinstance(value, int | float) or not is_number(value):
        return text
    number, space, unit = text.partition(" ")
    written = float(number)
    if not math.isfinite(written):  # a number may become infinite in its unit
        return text
    decimals = DIGITS - 1 - math.floor(math.log10(abs(written))) if written else 0
    return f"{format_number(round(written, max(0, decimals)))}{space}{unit}"
