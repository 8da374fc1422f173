"""Values as a person would write them: with units, reading gives the same value."""

import math
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from rbxcompose.base.config import Dimensioned
from rbxcompose.base.units import UNITS, Dimension, Unit, format_number, format_quantity, units_of, written_unit
from rbxcompose.manifest.shapes import alternatives, below, field_types

_LAST_DIGITS = 1e-12  # of a number, which a conversion between units may lose


def is_nearly(value: float, other: float) -> bool:
    """Return whether two numbers are the same but for their last digits."""
    return math.isclose(value, other, rel_tol=_LAST_DIGITS)


def rounder_unit(value: float, dimension: Dimension, wanted: str | None = None) -> str | None:
    """Return the unit for a value: the wanted or usual one, unless only another needs no more than six digits.

    So 3 rad/s^2 is not 171.887 deg/s^2. None if the dimension has no units.
    """
    units = units_of(dimension)
    usual = written_unit(format_quantity(value, dimension))
    if usual is None:
        return None
    first = wanted if wanted in units else usual

    def is_round(unit: Unit) -> bool:
        return is_nearly(unit.to_si(float(format_number(unit.from_si(value)))), value)

    return next((name for name in dict.fromkeys((first, usual, *units)) if is_round(UNITS[name])), first)


def as_written(config: BaseModel) -> dict[str, Any]:
    """Return the fields of a configuration that are set, quantities as texts."""
    types = field_types(type(config))
    found = {name: _written(getattr(config, name), hint) for name, hint in types.items()}
    return {name: value for name, value in found.items() if value is not None}


def _written(value: Any, hint: Any) -> Any:
    match value:
        case BaseModel():
            return as_written(value)
        case Mapping():
            return {key: _item(entry, hint, key) for key, entry in value.items()}
        case list() | tuple():
            return [_item(one, hint, index) for index, one in enumerate(value)]
        case int() | float() if not isinstance(value, bool):
            marks = (mark.dimension for mark in alternatives(hint) if isinstance(mark, Dimensioned))
            return next((_quantity(value, dimension) for dimension in marks), value)
    return value


def _item(value: Any, hint: Any, key: str | int) -> Any:
    return next((_written(value, inner) for inner in below(hint, key)), value)


def _quantity(value: float, dimension: Dimension) -> str:
    unit = _unit_of(dimension)
    return f"{unit.from_si(value)!r} {unit.name}"


def _unit_of(dimension: Dimension) -> Unit:
    """Return the unit in which the number is nearest to that in SI."""
    return min(
        (unit for unit in UNITS.values() if unit.dimension == dimension), key=lambda one: abs(one.times / one.per - 1)
    )
