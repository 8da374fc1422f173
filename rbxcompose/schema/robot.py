"""Schemas of the files that consist of sections: robots, the parts they include, and their overlays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rbxcompose.dataclass import dataclass
from rbxcompose.field_docs import field_docs
from rbxcompose.manifest.file_models import file_model
from rbxcompose.manifest.header import ManifestHeader
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT
from rbxcompose.schema.components import component_schemas
from rbxcompose.schema.controllers import controller_schemas
from rbxcompose.schema.overlays import laid_over, or_removed
from rbxcompose.schema.scalars import DEFINITIONS, Schema, quantities
from rbxcompose.schema.settle import opened, schemas_of
from rbxcompose.sections.components import components
from rbxcompose.sections.controllers import controllers
from rbxcompose.sections.profiles import profiles

MADE_OTHERWISE = (components, controllers, profiles)  # made from more than one model

CHANGES = "changes"  # the definition of the changes that the sections of a file accept
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
    made: dict[str, Schema] = {}
    for name, (entry, needed) in {
        components.name: component_schemas(types),
        controllers.name: controller_schemas(),
    }.items():
        schemas[name] = {"type": "object", "propertyNames": NAMES, "additionalProperties": entry}
        made |= needed
    return Sections({name: or_empty(opened(one, definitions)) for name, one in schemas.items()}, definitions | made)


def robot_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a robot's file."""
    made = sections_of(types)
    changes, definitions = _changes(made, ROBOT)
    keys = {name: {"$ref": f"{DEFINITIONS}{CHANGES}/properties/{name}"} for name in changes["properties"]}
    profile = or_removed({"type": "object", "properties": keys, "additionalProperties": False})
    entries = or_empty({"type": "object", "propertyNames": NAMES, "additionalProperties": profile})
    always = described({profiles.name: entries}, ROBOT)
    own = described(made.schemas, ROBOT)
    return document(ROBOT, file_model(ROBOT), own, definitions, always, may_change=True)


def part_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a part's file."""
    made = sections_of(types)
    _, definitions = _changes(made, PART)
    return document(PART, file_model(PART), described(made.schemas, PART), definitions, may_change=True)


def overlay_schema(types: Iterable[str]) -> Schema:
    """Return the schema of an overlay's file."""
    changes, definitions = _changes(sections_of(types), OVERLAY)
    return document(OVERLAY, file_model(OVERLAY), changes["properties"], definitions)


def _changes(made: Sections, kind: str) -> tuple[Schema, dict[str, Schema]]:
    """Return the schema of changes to the sections of a file, and all definitions, including that one."""
    overlay, definitions = laid_over(made.schemas, made.definitions)
    changes = {"properties": described(overlay, kind)}
    return changes, {**definitions, CHANGES: changes}


def document(
    kind: str,
    model: type[ManifestHeader],
    properties: Schema,
    definitions: Mapping[str, Schema],
    always: Mapping[str, Schema] | None = None,
    *,
    may_change: bool = False,
) -> Schema:
    """Return the schema of one kind of file: its header, then its own keys; `always` holds keys with a fixed schema.

    A file with `include` writes only changes to an entry, if it `may_change` what its parts bring.
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
    """Return the keys at the start of every manifest."""
    (made,) = schemas_of({"header": ManifestHeader})[1].values()
    return {
        **{name: dict(one) for name, one in made["properties"].items()},
        "rbx": {"const": 1, "description": field_docs(ManifestHeader)["rbx"]},
        "kind": {"const": kind, "description": field_docs(ManifestHeader)["kind"]},
    }


def described(schemas: Mapping[str, Schema], kind: str) -> dict[str, Schema]:
    """Return the sections of a kind of manifest, in their order, with their descriptions."""
    made = [one for one in all_sections(kind) if one.name in schemas]
    return {one.name: {**schemas[one.name], "description": one.doc} for one in made}


def or_empty(schema: Schema) -> Schema:
    """Return the schema of a section, which may be empty."""
    return {**schema, "type": ["object", "null"]} if schema.get("type") == "object" else schema


def reached(schema: Schema, definitions: Mapping[str, Schema]) -> dict[str, Schema]:
    """Return the definitions that a schema refers to, directly or indirectly, in alphabetical order."""
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
