"""From the schema of a robot's sections to that of an overlay: every key may be omitted or removed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbxcompose.manifest.options import OPTIONS
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.schema.components import COMPONENT
from rbxcompose.schema.scalars import DEFINITIONS, Schema
from rbxcompose.sections.components import components

OVER = "overlay_"  # prefix of a definition that differs in an overlay
REMOVED = "removed"
_REMOVED: Schema = {"enum": [None, ""], "description": "With the tag `!remove`: removes it from the layers below."}
_NOT_NEEDED = ("required", "minProperties", "minItems", "default")
_NOTES = ("description", "x-names", "x-dimension")  # what editors expect at the key itself


def laid_over(
    sections: Mapping[str, Schema], definitions: Mapping[str, Schema]
) -> tuple[dict[str, Schema], dict[str, Schema]]:
    """Return the sections as allowed in an overlay, and all definitions, including those that only overlays need."""
    over = _Overlay(definitions)
    schemas = {name: over.of(one) for name, one in sections.items()}
    for section in all_sections():
        if section.short and section.short.only_over:
            word = {"type": ["string", "number", "boolean", "array"], "description": section.short.only_over}
            choice = schemas[section.name]["additionalProperties"]
            schemas[section.name] = {
                **schemas[section.name],
                "additionalProperties": {"anyOf": [word, *choice["anyOf"]]},
            }
    schemas[components.name] = _told(schemas[components.name], definitions)
    changed = {f"{OVER}{name}": over.of(definitions[name]) for name in over.changed}
    return schemas, {**definitions, **changed, REMOVED: _REMOVED}


def _told(section: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return the section `components` with descriptions of the keys of an entry that does not repeat its type."""
    about: dict[str, list[str]] = {}
    for name in (one for one in definitions if one.startswith(COMPONENT)):
        for key, schema in definitions[name]["properties"].items():
            if key not in ("type", *OPTIONS) and "description" in schema:  # a group of fields may have none
                about.setdefault(key, []).append(f"Of `{name.removeprefix(COMPONENT)}`: {schema['description']}")
    keys = {key: {"description": "\n\n".join(texts)} for key, texts in sorted(about.items())}
    changed = {"if": {"not": {"anyOf": [{"required": ["type"]}]}}, "then": {"properties": keys}}
    entry, removed = section["additionalProperties"]["anyOf"]
    entry = {**entry, "allOf": [*entry["allOf"], changed]}
    return {**section, "additionalProperties": {**section["additionalProperties"], "anyOf": [entry, removed]}}


def or_removed(schema: Schema) -> Schema:
    """Return the schema of something that an overlay may also remove."""
    notes = {key: schema[key] for key in _NOTES if key in schema}
    rest = {key: value for key, value in schema.items() if key not in notes}
    choices = rest["anyOf"] if rest.keys() == {"anyOf"} else rest["allOf"] if rest.keys() == {"allOf"} else [rest]
    return {"anyOf": [*choices, {"$ref": f"{DEFINITIONS}{REMOVED}"}], **notes}


class _Overlay:
    """Turns schemas into those of an overlay; definitions that do not differ are shared with the robot's."""

    def __init__(self, definitions: Mapping[str, Schema]) -> None:
        self.changed: set[str] = set()
        while found := {
            name for name, one in definitions.items() if name not in self.changed and self._is_changed(one)
        }:
            self.changed |= found

    def _is_changed(self, schema: Schema) -> bool:
        return self.of(schema) != schema

    def of(self, schema: Schema) -> Schema:
        """Return the form of a schema in an overlay."""
        made: dict[str, Any] = {}
        for key, value in schema.items():
            match key:
                case "$ref" if value.removeprefix(DEFINITIONS) in self.changed:
                    made[key] = DEFINITIONS + OVER + value.removeprefix(DEFINITIONS)
                case "properties":
                    made[key] = {name: one if one is True else or_removed(self.of(one)) for name, one in value.items()}
                case "additionalProperties" if isinstance(value, dict):
                    made[key] = or_removed(self.of(value))
                case "allOf" | "anyOf":
                    made[key] = [self.of(one) for one in value]
                case "then" | "items" if isinstance(value, dict):
                    made[key] = self.of(value)
                case _ if key not in _NOT_NEEDED:
                    made[key] = value
        return made
