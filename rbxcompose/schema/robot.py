"""Schemas of what is made of sections: robots, the parts that they include, and what is laid over them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from rbxcompose.manifest.file_models import file_model
from rbxcompose.manifest.header import Header
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT
from rbxcompose.schema.components import component_schemas
from rbxcompose.schema.overlays import laid_over, or_removed
from rbxcompose.schema.scalars import Schema
from rbxcompose.schema.settle import opened, schemas_of
from rbxcompose.sections.components import components
from rbxcompose.sections.profiles import profiles

MADE_OTHERWISE = (components, profiles)  # of more than one model

NAMES: Schema = {"pattern": "^[a-z][a-z0-9_]*$", "maxLength": 60}


@dataclass(frozen=True, slots=True)
class Sections:
    """The schema of every section, and the definitions that they share."""

    schemas: Mapping[str, Schema]
    definitions: Mapping[str, Schema]


def sections_of(types: Iterable[str]) -> Sections:
    """Return the sections of a robot that may use these types of components."""
    others = [one for one in all_sections() if one not in MADE_OTHERWISE]
    schemas, definitions = schemas_of({one.name: one.type for one in others})
    entry, made = component_schemas(types)
    schemas[components.name] = {"type": "object", "propertyNames": NAMES, "additionalProperties": entry}
    return Sections({name: or_empty(opened(one, definitions)) for name, one in schemas.items()}, definitions | made)


def robot_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a robot's file."""
    made = sections_of(types)
    overlay, over = laid_over(made.schemas, made.definitions)
    profile = or_removed({"type": "object", "properties": described(overlay, ROBOT), "additionalProperties": False})
    changes = {profiles.name: or_empty({"type": "object", "propertyNames": NAMES, "additionalProperties": profile})}
    own, changing = described({**made.schemas, **changes}, ROBOT), described({**overlay, **changes}, ROBOT)
    return document(ROBOT, file_model(ROBOT), own, {**made.definitions, **over}, changing)


def part_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a part's file."""
    made = sections_of(types)
    overlay, over = laid_over(made.schemas, made.definitions)
    own, changing = described(made.schemas, PART), described(overlay, PART)
    return document(PART, file_model(PART), own, {**made.definitions, **over}, changing)


def overlay_schema(types: Iterable[str]) -> Schema:
    """Return the schema of an overlay's file."""
    made = sections_of(types)
    overlay, over = laid_over(made.schemas, made.definitions)
    return document(OVERLAY, file_model(OVERLAY), described(overlay, OVERLAY), over)


def document(
    kind: str,
    model: type[Header],
    properties: Schema,
    definitions: Mapping[str, Schema],
    changing: Schema | None = None,
) -> Schema:
    """Return the schema of a file of some kind: its header, then its own keys.

    `changing` are the keys of a file that includes parts: there it may write of an entry only what it changes.
    """
    made = {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"rbxcompose {kind}",
        "description": model.__doc__ or "",
        "type": "object",
        "properties": {**header(kind), **properties},
        "required": ["rbx", "kind", "name"],
        "additionalProperties": False,
    }
    if changing is not None:
        told = {name: {"description": schema["description"]} for name, schema in properties.items()}
        made["properties"] = {**header(kind), **told}
        made |= {"if": {"required": ["include"]}, "then": {"properties": changing}, "else": {"properties": properties}}
    return {**made, "definitions": reached({"own": properties, "changing": changing}, definitions)}


def header(kind: str) -> dict[str, Schema]:
    """Return the keys that every manifest begins with."""
    (made,) = schemas_of({"header": Header})[1].values()
    return {
        **{name: dict(one) for name, one in made["properties"].items()},
        "rbx": {"const": 1, "description": Header.model_fields["rbx"].description},
        "kind": {"const": kind, "description": Header.model_fields["kind"].description},
    }


def described(schemas: Mapping[str, Schema], kind: str) -> dict[str, Schema]:
    """Return the sections that a kind of manifest has, in their order, with what they are for."""
    made = [one for one in all_sections(kind) if one.name in schemas]
    return {one.name: {**schemas[one.name], "description": one.doc} for one in made}


def or_empty(schema: Schema) -> Schema:
    """Return the schema of a section, which may have nothing below its name."""
    return {**schema, "type": ["object", "null"]} if schema.get("type") == "object" else schema


def reached(schema: Schema, definitions: Mapping[str, Schema]) -> dict[str, Schema]:
    """Return the definitions that a schema refers to, also by way of others, in alphabetical order."""
    found: dict[str, Schema] = {}
    waiting = set(_references(schema))
    while waiting:
        name = waiting.pop()
        found[name] = definitions[name]
        waiting |= set(_references(definitions[name])) - found.keys()
    return {name: found[name] for name in sorted(found)}


def _references(schema: Any) -> Iterable[str]:
    match schema:
        case {"$ref": str(reference)}:
            yield reference.rpartition("/")[2]
        case dict():
            for inner in schema.values():
                yield from _references(inner)
        case list():
            for inner in schema:
                yield from _references(inner)
