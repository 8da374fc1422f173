"""From the schema of a robot's sections to that of an overlay: every key may be left out, and may be taken out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbxcompose.manifest.models import OPTIONS
from rbxcompose.schema.components import COMPONENT
from rbxcompose.schema.scalars import Schema
from rbxcompose.schema.settle import DEFINITIONS

OVER = "overlay_"  # begins the name of a definition that an overlay uses
REMOVED: Schema = {"enum": [None, ""], "description": "With the tag `!remove`: takes it out of what lies below."}
_NOT_NEEDED = ("required", "minProperties", "minItems", "default")
_SHORT = {"args": "the argument's value"}  # sections whose entries may be written as one word in an overlay


def laid_over(
    sections: Mapping[str, Schema], definitions: Mapping[str, Schema]
) -> tuple[dict[str, Schema], dict[str, Schema]]:
    """Return the sections as an overlay may have them, and the definitions that those need."""
    schemas = {name: _over(one) for name, one in sections.items()}
    for name, about in _SHORT.items():
        entry = schemas[name]["additionalProperties"]
        word = {"type": ["string", "number", "boolean", "array"], "description": about}
        schemas[name] = {**schemas[name], "additionalProperties": {"anyOf": [word, entry]}}
    schemas["components"] = _told(schemas["components"], definitions)
    return schemas, {f"{OVER}{name}": _over(one) for name, one in definitions.items()}


def _told(components: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return the section `components` with what the keys of an entry mean that does not repeat its type."""
    about: dict[str, list[str]] = {}
    for name in (one for one in definitions if one.startswith(COMPONENT)):
        for key, schema in definitions[name]["properties"].items():
            if key not in ("type", *OPTIONS):
                about.setdefault(key, []).append(f"Of `{name.removeprefix(COMPONENT)}`: {schema['description']}")
    keys = {key: {"description": "\n\n".join(texts)} for key, texts in sorted(about.items())}
    changed = {"if": {"not": {"anyOf": [{"required": ["type"]}]}}, "then": {"properties": keys}}
    entry, removed = components["additionalProperties"]["anyOf"]
    entry = {**entry, "allOf": [*entry["allOf"], changed]}
    return {**components, "additionalProperties": {**components["additionalProperties"], "anyOf": [entry, removed]}}


def or_removed(schema: Schema) -> Schema:
    """Return the schema of something that an overlay may also take out."""
    notes: Schema = {key: schema[key] for key in ("description", "x-names", "x-dimension") if key in schema}
    return {"anyOf": [schema, REMOVED], **notes}


def _over(schema: Schema) -> Schema:
    made: dict[str, Any] = {}
    for key, value in schema.items():
        match key:
            case "$ref":
                made[key] = DEFINITIONS + OVER + value.removeprefix(DEFINITIONS)
            case "properties":
                made[key] = {name: or_removed(_over(one)) for name, one in value.items()}
            case "additionalProperties" if isinstance(value, dict):
                made[key] = or_removed(_over(value))
            case "allOf" | "anyOf":
                made[key] = [_over(one) for one in value]
            case "then" | "items" if isinstance(value, dict):
                made[key] = _over(value)
            case _ if key not in _NOT_NEEDED:
                made[key] = value
    return made
