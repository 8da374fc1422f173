"""Schemas of single scalars: quantities with units, expressions, names, and `${...}` in place of any."""

import re
from functools import cache
from typing import Annotated, Any

from pydantic import TypeAdapter

from rbxcompose.base.config import ACTUATOR, ARM, CONTROLLER, FILE, JOINT, LINK, NAMES, OBJECT, PLACE, RUNNING, Name
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.units import DIMENSIONS, NUMBER_TEXT, Dimension, example, needs_unit, units_of
from rbxcompose.manifest.fields import TopicPattern

Schema = dict[str, Any]

SHARED = "$defs"  # the key of the definitions in a document
DEFINITIONS = f"#/{SHARED}/"
DIMENSION = "x-dimension"  # a keyword of ours: the dimension of a value
FILLED = r"\$\{"  # text that contains this gets its value when the files are composed
FILL: Schema = {"$ref": f"{DEFINITIONS}filled"}
COMPUTED = r"[$(*/+]|\s-\s"  # text that contains this is evaluated while the robot runs
_PLAIN = {"integer": "a whole number", "number": "a number", "boolean": "true or false"}
OR_NULL = "_or_null"  # suffix of the definition of a scalar that may be null
_TOPIC: Any = Annotated[str, TopicPattern]
_WORDS = {"name": TypeAdapter(Name).json_schema(), "topic": TypeAdapter(_TOPIC).json_schema()}
_NAME_OF = "name_of_"  # prefix of the definition of a text that is the name of something
_NAMED = (ACTUATOR, ARM, CONTROLLER, FILE, JOINT, LINK, OBJECT, PLACE, RUNNING)
_TEXT: Schema = {"type": ["string", "number", "boolean"]}
_BESIDE = {"description", "default"}  # what may stand beside a reference
_NOTES = ("description", "default", "examples", NAMES)


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


@cache
def quantities() -> dict[str, Schema]:
    """Return the definition of each quantity, as a setting and as an expression, and of each plain scalar."""
    settings = {dimension.name: _quantity(dimension, FILLED) for dimension in DIMENSIONS.values()}
    settings |= {_plain(name): _filled(name) for name in _PLAIN}
    settings |= {name: {**_patterned(word), "type": ["string"]} for name, word in _WORDS.items()}
    settings |= {f"{_NAME_OF}{kind}": {**_TEXT, NAMES: kind} for kind in _NAMED}
    settings |= {"text": _TEXT, "filled": {"type": ["string"], "pattern": FILLED}}
    optional = {
        f"{name}{OR_NULL}": {**setting, "type": [*setting["type"], "null"]} for name, setting in settings.items()
    }
    return (
        settings
        | optional
        | {_expression(dimension): _quantity(dimension, COMPUTED) for dimension in DIMENSIONS.values()}
    )


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
        name = next((name for name, word in _WORDS.items() if word == rest), "")
        if name and notes.keys() <= _BESIDE:
            return {"$ref": f"{DEFINITIONS}{name}", **notes}
        if "pattern" in rest:
            return {**_patterned(rest), **notes}
        if rest.keys() == {"type"} and notes.keys() <= {*_BESIDE, NAMES} and notes.get(NAMES) in (None, *_NAMED):
            name = f"{_NAME_OF}{notes.pop(NAMES)}" if NAMES in notes else "text"
            return {"$ref": f"{DEFINITIONS}{name}", **notes}
        return {**rest, **_TEXT, **notes}  # a text accepts its scalar as written
    if types not in _PLAIN:
        return schema
    if rest.keys() == {"type"} and notes.keys() <= _BESIDE:
        return {"$ref": f"{DEFINITIONS}{_plain(types)}", **notes}
    return {**rest, **_filled(types), **notes}


def _patterned(text: Schema) -> Schema:
    return {**text, "pattern": f"({text['pattern']})|{FILLED}"}


def _plain(name: str) -> str:
    return f"plain_{name}"


def _filled(name: str) -> Schema:
    return {"type": [name, "string"], "pattern": FILLED, **_complaint(f"must be {_PLAIN[name]}")}
