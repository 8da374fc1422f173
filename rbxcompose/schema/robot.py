"""Schemas of what is made of sections: robots, the parts that they include, and what is laid over them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from rbxcompose.config import Config, Name
from rbxcompose.manifest.arguments import ArgumentModel
from rbxcompose.manifest.models import (
    Body,
    Bus,
    Diagnostics,
    Header,
    IncludeModel,
    MissionModel,
    Mux,
    Needs,
    OverlayFile,
    PartFile,
    PlaceModel,
    Provides,
    RobotFile,
    ValueModel,
)
from rbxcompose.schema.components import component_schemas
from rbxcompose.schema.overlays import laid_over, or_removed
from rbxcompose.schema.scalars import DEFINITIONS, Schema, quantities
from rbxcompose.schema.settle import opened, schemas_of

SECTION_TYPES: Mapping[str, Any] = {
    "args": dict[Name, ArgumentModel],
    "include": dict[Name, IncludeModel],
    "body": Body,
    "bus": Bus,
    "muxes": dict[Name, Mux],
    "diagnostics": Diagnostics,
    "places": dict[Name, PlaceModel],
    "values": dict[Name, ValueModel],
    "missions": dict[Name, MissionModel],
    "start": Name,
    "needs": Needs,
    "provides": Provides,
}
"""What stands in each section, but for `components` and `profiles`, which are made of more than models."""

CHANGES = "changes"  # the definition of what may be laid over the sections of a file
NAMES: Schema = {"pattern": "^[a-z][a-z0-9_]*$", "maxLength": 60}


@dataclass(frozen=True, slots=True)
class Sections:
    """The schema of every section, and the definitions that they share."""

    schemas: Mapping[str, Schema]
    definitions: Mapping[str, Schema]


def sections_of(types: Iterable[str]) -> Sections:
    """Return the sections of a robot that may use these types of components."""
    schemas, definitions = schemas_of(SECTION_TYPES)
    entry, made = component_schemas(types)
    schemas["components"] = {"type": "object", "propertyNames": NAMES, "additionalProperties": entry}
    return Sections({name: or_empty(opened(one, definitions)) for name, one in schemas.items()}, definitions | made)


def robot_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a robot's file."""
    sections = sections_of(types)
    changes, definitions = _changes(sections, RobotFile)
    keys = {name: {"$ref": f"{DEFINITIONS}{CHANGES}/properties/{name}"} for name in changes["properties"]}
    profile = or_removed({"type": "object", "properties": keys, "additionalProperties": False})
    profiles = or_empty({"type": "object", "propertyNames": NAMES, "additionalProperties": profile})
    always = described({"profiles": profiles}, RobotFile)
    return document("Robot", RobotFile, described(sections.schemas, RobotFile), definitions, always, may_change=True)


def part_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a part's file."""
    sections = sections_of(types)
    _, definitions = _changes(sections, PartFile)
    return document("Part", PartFile, described(sections.schemas, PartFile), definitions, may_change=True)


def overlay_schema(types: Iterable[str]) -> Schema:
    """Return the schema of an overlay's file."""
    changes, definitions = _changes(sections_of(types), OverlayFile)
    return document("Overlay", OverlayFile, changes["properties"], definitions)


def _changes(sections: Sections, model: type[Config]) -> tuple[Schema, dict[str, Schema]]:
    """Return what may be laid over the sections of a file, and all definitions, that one among them."""
    overlay, definitions = laid_over(sections.schemas, sections.definitions)
    changes = {"properties": described(overlay, model)}
    return changes, {**definitions, CHANGES: changes}


def document(
    kind: str,
    model: type[Config],
    properties: Schema,
    definitions: Mapping[str, Schema],
    always: Mapping[str, Schema] | None = None,
    *,
    may_change: bool = False,
) -> Schema:
    """Return the schema of a file of some kind: its header, then its own keys, of which `always` have one schema.

    A file that includes parts writes of an entry only what it changes, if it `may_change` what they bring.
    """
    made = {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"rbxcompose {kind}",
        "description": model.__doc__ or "",
        "type": "object",
        "properties": {**header(kind), **properties, **(always or {})},
        "required": ["rbx", "kind", "name"],
        "additionalProperties": False,
    }
    if may_change:
        told = {name: {"description": schema["description"]} for name, schema in properties.items()}
        made["properties"] = {**header(kind), **told, **(always or {})}
        changed = {"$ref": f"{DEFINITIONS}{CHANGES}"}
        made |= {"if": {"required": ["include"]}, "then": changed, "else": {"properties": properties}}
    return {**made, "definitions": reached(made, {**quantities(), **definitions})}


def header(kind: str) -> dict[str, Schema]:
    """Return the keys that every manifest begins with."""
    (made,) = schemas_of({"header": Header})[1].values()
    return {
        **{name: dict(one) for name, one in made["properties"].items()},
        "rbx": {"const": 1, "description": Header.model_fields["rbx"].description},
        "kind": {"const": kind, "description": Header.model_fields["kind"].description},
    }


def described(schemas: Mapping[str, Schema], model: type[Config]) -> dict[str, Schema]:
    """Return sections with what the model of their file says they are for, in the model's order."""
    fields = model.model_fields
    return {
        name: {**schemas[name], "description": field.description} for name, field in fields.items() if name in schemas
    }


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
            yield reference.removeprefix(DEFINITIONS).partition("/")[0]
        case dict():
            for inner in schema.values():
                yield from _references(inner)
        case list():
            for inner in schema:
                yield from _references(inner)
