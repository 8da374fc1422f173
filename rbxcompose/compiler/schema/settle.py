"""From pydantic's JSON Schema to that of a manifest: draft 7, quantities with units, `${...}` where a scalar is."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import TypeAdapter

from rbxcompose.base.units import DIMENSIONS, format_quantity
from rbxcompose.compiler.schema.scalars import DEFINITIONS, DIMENSION, OR_NULL, Schema, or_filled, quantities, quantity
from rbxcompose.manifest.shapes import rounder_unit

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
    raw = {"anyOf" if key == "oneOf" else key: value for key, value in raw.items() if key != "title"}
    if raw.get("default", 0) in _NOTHING:
        del raw["default"]
    if DIMENSION in raw:
        return _quantity(raw)
    if "oneOf" in raw:  # of members that are told apart by a function, which a schema cannot call
        raw = {"anyOf" if key == "oneOf" else key: value for key, value in raw.items()}
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


def _quantity(raw: Schema) -> Schema:
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
