"""Schemas of the files that consist of sections: robots, the parts they include, and their overlays."""

import inspect
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any

from rbxcompose.base.config import field_docs
from rbxcompose.compiler.schema.overlays import SECTION, WHOLE, laid_over, or_removed, references
from rbxcompose.compiler.schema.scalars import (
    COMPONENT,
    DEFINITIONS,
    SHARED,
    TYPE,
    Schema,
    opened,
    quantities,
    schemas_of,
)
from rbxcompose.compiler.sections.components import components
from rbxcompose.compiler.sections.composition import profiles
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.registry import file_model
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT, ComponentOptions, Section
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.sdk.registry import component_type

_EXAMPLE = "Example:"


def component_schemas(types: Iterable[str]) -> tuple[Schema, dict[str, Schema]]:
    """Return the schema of one entry of `components`, and the definitions that it needs: one for each type.

    What sections run by themselves is known by its type only: `check` warns of it anyway.
    """
    known = {name: component_type(name) for name in sorted(types)}
    classes = {name: cls for name, cls in known.items() if not cls.made_by}
    wanted: dict[str, Any] = {name: cls.config_type() for name, cls in classes.items()}
    schemas, definitions = schemas_of({**wanted, "": ComponentOptions})
    options = opened(schemas.pop(""), definitions)["properties"]
    for name, schema in schemas.items():
        own = opened(schema, definitions)
        definitions[f"{COMPONENT}{name}"] = {
            "description": _about(classes[name]),
            "type": "object",
            "properties": {TYPE: True, **own.get("properties", {}), **dict.fromkeys(options, True)},
            "required": [TYPE, *own.get("required", [])],
            "additionalProperties": False,
            "examples": examples_of(classes[name]),
        }
    definitions[TYPE] = _word(known)
    word = {"anyOf": [{"$ref": f"{DEFINITIONS}{TYPE}"}], "description": "What runs: the name of a component type."}
    about = "What runs under this name: its `type`, and the configuration of that type."
    return {"description": about, **_entry(COMPONENT, word, classes, options)}, definitions


def typed_schemas(section: Section[Any, Any], classes: Mapping[str, Any]) -> tuple[Schema, dict[str, Schema]]:
    """Return the schema of one entry of a section, and the definitions that it needs: one for each of these types."""
    prefix, word_name = f"{section.entry}_", f"type_of_{section.entry}"
    schemas, definitions = schemas_of({name: cls.config_type() for name, cls in classes.items()})
    for name, schema in schemas.items():
        definitions[f"{prefix}{name}"] = {**opened(schema, definitions), "description": _about(classes[name])}
    model: Any = section.model
    about = f"{field_docs(model)[TYPE].removesuffix('.')}: the name of a type of {section.name}."
    definitions[word_name] = {"type": "string", **_word(classes)}
    word = {"$ref": f"{DEFINITIONS}{word_name}", "description": about}
    return _entry(prefix, word, classes, {}), definitions


def _entry(prefix: str, word: Schema, types: Iterable[str], options: Mapping[str, Any]) -> Schema:
    chosen = [
        {
            "if": {"properties": {TYPE: {"const": name}}, "required": [TYPE]},
            "then": {"$ref": f"{DEFINITIONS}{prefix}{name}"},
        }
        for name in types
    ]
    return {"type": "object", "required": [TYPE], "properties": {TYPE: word, **options}, "allOf": chosen}


def _word(classes: Mapping[str, type[Any]]) -> Schema:
    about = [getattr(cls, "made_by", "") or _about(cls) for cls in classes.values()]
    return {"enum": [*classes], "enumDescriptions": about}


def _about(cls: type[Any]) -> str:
    """Return the description of a type: the first paragraph of its docstring; the reference has the rest."""
    return " ".join((inspect.getdoc(cls) or "").partition("\n\n")[0].split())


def examples_of(cls: type[Any]) -> list[object]:
    """Return the configurations that a type's docstring shows."""
    text = textwrap.dedent((inspect.getdoc(cls) or "").partition(_EXAMPLE)[2])
    node, _ = read_text(text, cls.__name__) if text.strip() else (None, [])
    return [to_plain(entry.value) for entry in node.entries.values()] if isinstance(node, MappingNode) else []


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
