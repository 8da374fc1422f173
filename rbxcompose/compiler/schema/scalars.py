"""From pydantic's JSON Schema to that of a manifest: draft 7, quantities with units, `${...}` where a scalar is."""

import re
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import TypeAdapter

from rbxcompose.base.config import ACTUATOR, ARM, CONTROLLER, FILE, JOINT, LINK, NAMES, OBJECT, PLACE, RUNNING, Name
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.units import DIMENSIONS, NUMBER_TEXT, Dimension, example, format_quantity, needs_unit, units_of
from rbxcompose.manifest.fields import TopicPattern
from rbxcompose.manifest.shapes import rounder_unit

Schema = dict[str, Any]

TYPE = "type"  # the key of an entry that names its type
COMPONENT = "component_"  # prefix of the definition of a type of components
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


_SIDE: Literal["validation"] = "validation"
_NOTHING: tuple[Any, ...] = (None, {}, [], "")


def schemas_of(types: Mapping[str, Any]) -> tuple[dict[str, Schema], dict[str, Schema]]:
    """Return the schema of each type by its key, and their shared definitions."""
    adapters = [(key, _SIDE, TypeAdapter(type_)) for key, type_ in types.items()]
    raw, shared = TypeAdapter.json_schemas(adapters, ref_template=DEFINITIONS + "{model}")
    definitions = {name: settled(entry) for name, entry in shared.get("$defs", {}).items()}
    return {key: settled(raw[key, _SIDE]) for key in types}, definitions


def opened(schema: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return the definition that a schema refers to, or the schema itself."""
    return definitions.get(schema.get("$ref", "").removeprefix(DEFINITIONS), schema)


def referred(schema: Schema, document: Schema) -> Schema:
    """Return the target of a schema's reference in its document, with the notes beside it, or the schema itself."""
    found: Any = document if "$ref" in schema else schema
    for key in schema.get("$ref", "").split("/")[1:]:
        found = found[key]
    return {**found, **{key: value for key, value in schema.items() if key != "$ref"}}


def settled(raw: Schema) -> Schema:
    """Return the manifest form of one of pydantic's schemas."""
    # `oneOf` is of members that are told apart by a function, which a schema cannot call.
    raw = {"anyOf" if key == "oneOf" else key: value for key, value in raw.items() if key != "title"}
    if raw.get("default", 0) in _NOTHING:
        del raw["default"]
    if DIMENSION in raw:
        return _settled_quantity(raw)
    if "anyOf" in raw:
        return _any_of(raw)
    if "$ref" in raw:  # editors see what is beside it, validators need not
        return raw
    match raw.get("type"):
        case "object" if "properties" in raw:
            return {**raw, "properties": {name: settled(property_) for name, property_ in raw["properties"].items()}}
        case "object":
            return _map(raw)
        case "array":
            return or_filled(_list(raw))
        case None:
            return raw
    return or_filled(raw)


def _settled_quantity(raw: Schema) -> Schema:
    dimension = DIMENSIONS[raw[DIMENSION]]
    notes = {key: raw[key] for key in ("description",) if key in raw}
    if "default" in raw:
        notes["default"] = format_quantity(raw["default"], dimension, rounder_unit(raw["default"], dimension))
    return {**quantity(dimension), **notes}


def _any_of(raw: Schema) -> Schema:
    """Return a choice between schemas; an optional one becomes a single schema with one more type."""
    members = [settled(one) for one in raw["anyOf"] if one != {"type": "null"}]
    rest = {key: value for key, value in raw.items() if key != "anyOf"}
    is_optional = len(members) < len(raw["anyOf"])
    if is_optional and len(members) == 1:
        reference = f"{members[0].get('$ref', '')}{OR_NULL}"
        if reference.removeprefix(DEFINITIONS) in quantities():
            return {**members[0], "$ref": reference, **rest}
    if is_optional and len(members) == 1 and "type" in (only := members[0]):
        return {**only, "type": [*_listed(only["type"]), "null"], **rest}
    return {"anyOf": [*members, *([{"type": "null"}] if is_optional else [])], **rest}


def _listed(types: str | list[str]) -> list[str]:
    return [types] if isinstance(types, str) else types


def _map(raw: Schema) -> Schema:
    """Return a map by name: the pattern applies to the keys, so that a wrong name is reported as one."""
    made = {key: value for key, value in raw.items() if key != "patternProperties"}
    for pattern, entry in raw.get("patternProperties", {}).items():
        made["additionalProperties"] = entry
        made["propertyNames"] = {"pattern": pattern, **raw.get("propertyNames", {})}
    if isinstance(made.get("additionalProperties"), dict):
        made["additionalProperties"] = settled(made["additionalProperties"])
    return made


def _list(raw: Schema) -> Schema:
    made = {key: value for key, value in raw.items() if key != "prefixItems"}
    if "prefixItems" in raw:
        made["items"] = [settled(item) for item in raw["prefixItems"]]
    elif "items" in raw:
        made["items"] = settled(raw["items"])
    return made
