"""How values are written for people: with the unit of their type, places without underscores."""

from __future__ import annotations

from rbxcompose.expressions.text import show_value
from rbxcompose.expressions.types import UNKNOWN, Type
from rbxcompose.expressions.values import Value, is_number
from rbxcompose.units import format_quantity


def show(type: Type | None, value: Value) -> str:
    """Return a value as text: '49 %', 'living room', '2'."""
    dimension = (type or UNKNOWN).dimension
    if dimension and isinstance(value, int | float) and is_number(value):
        return format_quantity(value, dimension)
    return show_value("", value)
