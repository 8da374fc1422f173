"""How values are written for people: with the unit of their type, places without underscores."""

import math
from collections.abc import Collection, Mapping

from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.base.expressions.values import Value, is_located, is_named_pose, is_number
from rbxcompose.base.units import format_number, format_quantity

DIGITS = 3  # that people want to read of something measured


def show(type: Type | None, value: Value, *, briefly: bool = False, places: Collection[str] = ()) -> str:
    """Return a value as text: '48.8889 %', '2'; of lists and maps, each entry by its own type.

    If `briefly`, numbers have three digits, or more if there are more before the point: '48.9 %'. Names of `places`
    are written as people say them: 'living room'.
    """
    known = type or UNKNOWN

    def within(inner: Type, entry: Value) -> str:
        return show(inner, entry, briefly=briefly, places=places)

    if isinstance(value, Mapping):
        return ", ".join(f"{within(UNKNOWN, name)}: {within(known.part(name), entry)}" for name, entry in value.items())
    if isinstance(value, list | tuple):
        parts = known.parts if len(known.parts) == len(value) else {}  # else it is no more what it was
        return ", ".join(within(parts.get(str(index), known.entry), item) for index, item in enumerate(value))
    if isinstance(value, str):
        return value.replace("_", " ") if value in places else value
    if isinstance(value, bool):
        return "true" if value else "false"
    if is_number(value):
        text = format_quantity(value, known.dimension) if known.dimension else format_number(value)
        return _brief(text) if briefly else text
    if is_named_pose(value):
        return value.name.replace("_", " ")
    if is_located(value):
        return f"({format_number(value.x)} m, {format_number(value.y)} m)"
    return str(value)


def show_briefly(type: Type | None, value: Value) -> str:
    """Return a value as text, with numbers of three digits: '48.9 %'."""
    return show(type, value, briefly=True)


def _brief(text: str) -> str:
    number, space, unit = text.partition(" ")
    written = float(number)
    if not math.isfinite(written):  # a number may become infinite in its unit
        return text
    decimals = DIGITS - 1 - math.floor(math.log10(abs(written))) if written else 0
    return f"{format_number(round(written, max(0, decimals)))}{space}{unit}"
