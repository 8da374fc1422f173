"""The unit in which a person would write an exact value."""

from __future__ import annotations

import math

from rbxcompose.units import UNITS, Dimension, Unit, format_number, format_quantity, units_of, written_unit

_LAST_DIGITS = 1e-12  # of a number, which a conversion between units may lose


def is_nearly(one: float, other: float) -> bool:
    """Return whether two numbers are the same but for their last digits."""
    return math.isclose(one, other, rel_tol=_LAST_DIGITS)


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
