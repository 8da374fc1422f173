"""Dimensions and quantities as data for JSON, and back."""

from __future__ import annotations

from typing import Any

from rbxcompose.base.units import DIMENSIONS, Dimension, Quantity


def dimension_to_data(dimension: Dimension) -> str | dict[str, Any]:
    """Return the name of a dimension, if it has its own, else the name with the exponents."""
    if DIMENSIONS.get(dimension.name) == dimension:
        return dimension.name
    return {"name": dimension.name, "exponents": list(dimension.exponents)}


def dimension_of_data(data: Any) -> Dimension:
    """Return the dimension that `dimension_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    if isinstance(data, str):
        return DIMENSIONS[data]
    return Dimension(str(data["name"]), tuple(map(int, data["exponents"])))


def quantity_to_data(quantity: Quantity) -> dict[str, Any]:
    """Return the value in SI with its dimension."""
    return {"value": quantity.value, "dimension": dimension_to_data(quantity.dimension)}


def quantity_of_data(data: Any) -> Quantity:
    """Return the quantity that `quantity_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    return Quantity(float(data["value"]), dimension_of_data(data["dimension"]))
