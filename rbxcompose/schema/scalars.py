"""Schemas of single scalars: quantities with units, expressions, names, and `${...}` in place of any."""

from __future__ import annotations

import re
from typing import Any

from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.units import DIMENSIONS, NUMBER_TEXT, Dimension, example, needs_unit, units_of

Schema = dict[str, Any]

DEFINITIONS = "#/definitions/"
DIMENSION = "x-dimension"  # a keyword of ours: the dimension of a value
FILLED = r"\$\{"  # text that contains this gets its value when the files are composed
FILL: Schema = {"type": "string", "pattern": FILLED}
COMPUTED = r"[$(*/+]|\s-\s"  # text that contains this is evaluated while the robot runs
_PLAIN = {"integer": "a whole number", "number": "a number", "boolean": "true or false"}
_NOTES = ("description", "default", "examples", "x-names")


def quantity(dimension: Dimension) -> Schema:
    """Return the schema of a number with a unit of `dimension`, or a bare number where that means SI."""
    return {"$ref": f"{DEFINITIONS}{dimension.name}"}


def computed(wanted: Type, what: str = "") -> Schema:
    """Return the schema of an expression whose value must be of the type `wanted`."""
    if wanted.kind is TypeKind.FLAG:
        return {"type": ["string", "boolean"], "minLength": 1}
    if wanted.kind is TypeKind.COUNT:
        message = f"must be {what}" if what else "must be a whole number"
        return {"type": ["integer", "string"], "pattern": COMPUTED, **_complaint(message), "minimum": 0}
    if wanted.kind is TypeKind.QUANTITY and wanted.dimension:
        return {"$ref": f"{DEFINITIONS}{_expression(wanted.dimension)}"}
    return {"type": ["string", "number", "boolean"]}


def quantities() -> dict[str, Schema]:
    """Return the definition of each quantity, as a setting and as an expression."""
    settings = {one.name: _quantity(one, FILLED) for one in DIMENSIONS.values()}
    return settings | {_expression(one): _quantity(one, COMPUTED) for one in DIMENSIONS.values()}


def _expression(dimension: Dimension) -> str:
    return f"{dimension.name}_expression"


def _quantity(dimension: Dimension, otherwise: str) -> Schema:
    sample = example(dimension)
    return {
        "type": ["string"] if needs_unit(dimension) else ["string", "number"],
        "pattern": f"{_number_with_unit(dimension)}|{otherwise}",
        **_complaint(f"must be {dimension.phrase}, such as '{sample}'"),
        "examples": [sample],
        DIMENSION: dimension.name,
    }


def _complaint(message: str) -> Schema:
    """Return the message that editors show for a value of another type or form."""
    return {"errorMessage": message, "patternErrorMessage": message}


def _number_with_unit(dimension: Dimension) -> str:
    units = "|".join(re.escape(unit) for unit in units_of(dimension))
    unit = f"({units}){'' if needs_unit(dimension) else '?'}" if units else ""
    return rf"^\s*[+-]?{NUMBER_TEXT}\s*{unit}\s*$"


def or_filled(schema: Schema) -> Schema:
    """Return a schema that accepts what `schema` does, or a `${...}` in its place."""
    notes = {key: schema[key] for key in _NOTES if key in schema}
    rest = {key: value for key, value in schema.items() if key not in _NOTES}
    types = rest.get("type")
    if "enum" in rest or "const" in rest or types in ("array", "object"):
        return {"anyOf": [rest, FILL], **notes}
    if types == "string":
        if "pattern" in rest:
            return {**rest, "pattern": f"({rest['pattern']})|{FILLED}", **notes}
        return {**rest, "type": ["string", "number", "boolean"], **notes}  # a text accepts its scalar as written
    if types not in _PLAIN:
        return schema
    return {**rest, "type": [types, "string"], "pattern": FILLED, **_complaint(f"must be {_PLAIN[types]}"), **notes}
