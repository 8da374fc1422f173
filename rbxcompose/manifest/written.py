"""Configurations as plain data, with units, as a person would write them: reading it gives an equal one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from rbxcompose.config import Dimensioned
from rbxcompose.manifest.shapes import alternatives, below, field_types
from rbxcompose.units import UNITS, Dimension, Unit


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
            return {key: _item(one, hint, key) for key, one in value.items()}
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
        (one for one in UNITS.values() if one.dimension == dimension), key=lambda one: abs(one.times / one.per - 1)
    )
