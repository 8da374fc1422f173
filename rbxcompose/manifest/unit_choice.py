"""The unit in which a person would write an exact value."""

from __future__ import annotations

from rbxcompose.units import UNITS, Dimension, Unit, format_number, format_quantity, units_of, written_unit


def rounder_unit(value: float, dimension: Dimension, wanted: str | None = None) -> str | None:
    """Return the unit for an exact value: the wanted or usual one, unless only another needs no more than six digits.

    So 3 rad/s^2 is not 171.887 deg/s^2. None if the dimension has no units.
    """
    units = units_of(dimension)
    usual = written_unit(format_quantity(value, dimension))
    if usual is None:
        return None
    first = wanted if wanted in units else usual

    def is_round(unit: Unit) -> bool:
        return unit.to_si(float(format_number(unit.from_si(value)))) == value

    return next((name for name in dict.fromkeys((first, usual, *units)) if is_round(UNITS[name])), first)
