"""Schemas of the files that consist of sections: robots, the parts they include, and their overlays."""

from collections.abc import Iterable, Mapping
from typing import Any

from rbxcompose.base.config import field_docs
from rbxcompose.compiler.schema.entries import component_schemas, typed_schemas
from rbxcompose.compiler.schema.overlays import SECTION, WHOLE, laid_over, or_removed, references
from rbxcompose.compiler.schema.scalars import DEFINITIONS, SHARED, Schema, quantities
from rbxcompose.compiler.schema.settle import opened, schemas_of
from rbxcompose.compiler.sections.components import components
from rbxcompose.compiler.sections.composition import profiles
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.registry import file_model
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT

NAMES: Schema = {"pattern": "^[a-z][a-z0-9_]*$", "maxLength": 60}


def definitions_of(types: Iterable[str]) -> dict[str, Schema]:
    """Return the definitions of a robot that may use these types: each section, what it needs, and changes to them."""
    made = {section.name: typed_schemas(section, section.types()) for section in all_sections() if section.types}
    made[components.name] = component_schemas(types)
    others = [section for section in all_sections() if section.name not in (*made, profiles.name)]
    schemas, definitions = schemas_of({other.name: other.type for other in others})
    for name, (entry, needed) in made.items():
        schemas[name] = {"type": "object", "propertyNames": NAMES, "additionalProperties": entry}
        definitions |= needed
    about = {section.name: section.doc for section in all_sections()}
    for name, schema in schemas.items():
        definitions[f"{SECTION}{name}"] = {**or_empty(opened(schema, definitions)), "description": about[name]}
    return laid_over(definitions)


def robot_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a robot's file."""
    definitions = definitions_of(types)
    keys = _sections(definitions, ROBOT)
    profile = or_removed({"type": "object", "properties": keys, "additionalProperties": False})
    entries = or_empty({"type": "object", "propertyNames": NAMES, "additionalProperties": profile})
    return _included(ROBOT, definitions, {profiles.name: {**entries, "description": profiles.doc}})


def part_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a part's file."""
    return _included(PART, definitions_of(types))


def overlay_schema(types: Iterable[str]) -> Schema:
    """Return the schema of an overlay's file."""
    definitions = definitions_of(types)
    return document(OVERLAY, file_model(OVERLAY), _sections(definitions, OVERLAY), definitions)


def _sections(definitions: Mapping[str, Schema], kind: str) -> dict[str, Schema]:
    """Return references to the sections of a kind of manifest, in their order, as changes."""
    names = [section.name for section in all_sections(kind) if f"{SECTION}{section.name}" in definitions]
    return {name: {"$ref": f"{DEFINITIONS}{SECTION}{name}"} for name in names}


def _included(kind: str, definitions: Mapping[str, Schema], always: Mapping[str, Schema] | None = None) -> Schema:
    """Return the schema of a file that writes only changes to entries if it has `include`; `always` is the same."""
    changes = _sections(definitions, kind)
    described = {
        name: {**change, "description": definitions[f"{SECTION}{name}"]["description"]}
        for name, change in changes.items()
    }
    wholes = {name: {"$ref": f"{DEFINITIONS}{WHOLE}{SECTION}{name}"} for name in changes}
    own = {name: whole for name, whole in wholes.items() if f"{WHOLE}{SECTION}{name}" in definitions}
    choice = {"if": {"required": ["include"]}, "then": {}, "else": {"properties": own}}
    return document(kind, file_model(kind), {**described, **(always or {})}, definitions, choice)


def document(
    kind: str,
    model: type[ManifestHeader],
    properties: Mapping[str, Schema],
    definitions: Mapping[str, Schema],
    choice: Mapping[str, Any] | None = None,
) -> Schema:
    """Return the schema of one kind of file: its header, then its own keys, and what depends on another key."""
    made = {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"rbxcompose {kind}",
        "description": model.__doc__ or "",
        "type": "object",
        "properties": {**header(kind), **properties},
        "required": ["rbx", "kind", "name"],
        "additionalProperties": False,
        **(choice or {}),
    }
    return _whole(made, definitions)


def header(kind: str) -> dict[str, Schema]:
    """Return the keys at the start of every manifest."""
    (made,) = schemas_of({"header": ManifestHeader})[1].values()
    return {
        **{name: dict(property_) for name, property_ in made["properties"].items()},
        "rbx": {"const": 1, "description": field_docs(ManifestHeader)["rbx"]},
        "kind": {"const": kind, "description": field_docs(ManifestHeader)["kind"]},
    }


def or_empty(schema: Schema) -> Schema:
    """Return the schema of a section, which may be empty."""
    return {**schema, "type": ["object", "null"]} if schema.get("type") == "object" else schema


def _whole(schema: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return a schema with the definitions that it refers to, directly or indirectly, in alphabetical order."""
    definitions = {**quantities(), **definitions}
    found: dict[str, Schema] = {}
    waiting = set(references(schema))
    while waiting:
        name = waiting.pop()
        found[name] = definitions[name]
        waiting |= set(references(definitions[name])) - found.keys()
    return {**schema, SHARED: {name: found[name] for name in sorted(found)}}
