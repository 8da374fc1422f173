"""From the schema of a robot's sections to that of an overlay: every key may be left out, and may be taken out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbxcompose.manifest.options import OPTIONS
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.schema.components import COMPONENT
from rbxcompose.schema.scalars import Schema
from rbxcompose.schema.settle import DEFINITIONS
from rbxcompose.sections.components import components

OVER = "overlay_"  # begins the name of a definition that an overlay uses
REMOVED: Schema = {"enum": [None, ""], "description": "With the tag `!remove`: takes it out of what lies below."}
_NOT_NEEDED = ("required", "minProperties", "minItems", "default")


def laid_over(
    sections: Mapping[str, Schema], definitions: Mapping[str, Schema]
) -> tuple[dict[str, Schema], dict[str, Schema]]:
    """Return the sections as an overlay may have them, and the definitions that those need."""
    schemas = {name: _over(one) for name, one in sections.items()}
    for section in all_sections():
        if section.short and section.short.only_over:
            entry = schemas[section.name]["additionalProperties"]
            word = {"type": ["string", "number", "boolean", "array"], "description": section.short.only_over}
            schemas[section.name] = {**schemas[section.name], "additionalProperties": {"anyOf": [word, entry]}}
    schemas[components.name] = _told(schemas[components.name], definitions)
    return schemas, {f"{OVER}{name}": _over(one) for name, one in definitions.items()}


def _told(section: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return the section `components` with what the keys of an entry mean that does not repeat its type."""
    about: dict[str, list[str]] = {}
    for name in (one for one in definitions if one.startswith(COMPONENT)):
        for key, schema in definitions[name]["properties"].items():
            if key not in ("type", *OPTIONS):
                about.setdefault(key, []).append(f"Of `{name.removeprefix(COMPONENT)}`: {schema['description']}")
    keys = {key: {"description": "\n\n".join(texts)} for key, texts in sorted(about.items())}
    changed = {"if": {"not": {"anyOf": [{"required": ["type"]}]}}, "then": {"properties": keys}}
    entry, removed = section["additionalProperties"]["anyOf"]
    entry = {**entry, "allOf": [*entry["allOf"], changed]}
    return {**section, "additionalProperties": {**section["additionalProperties"], "anyOf": [entry, removed]}}


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
