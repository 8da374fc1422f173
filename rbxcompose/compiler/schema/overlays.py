"""What an overlay writes of a section, where every key may be omitted or removed, and what a whole section has.

A definition describes changes, and `whole_` before its name what is complete: it refers to the former, and adds what
must be there. So each key is described once.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.compiler.schema.entries import COMPONENT, TYPE
from rbxcompose.compiler.schema.scalars import DEFINITIONS, Schema, quantities
from rbxcompose.compiler.sections.components import components
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.manifest.section import OPTIONS

WHOLE = "whole_"  # prefix of a definition that allows neither to remove keys nor to omit required ones
SECTION = "section_"  # prefix of the definition of a section
REMOVED = "removed"
OR_REMOVED = "_or_no"  # suffix of a definition to which that is added
PRESENT = "present"
# No `enum` or `type`: editors would propose `null` and `""` as values of every key.
_EMPTY: Schema = {"maxLength": 0, "not": {"type": ["number", "boolean", "object", "array"]}}
_REMOVED: Schema = {**_EMPTY, "description": "With the tag `!remove`: removes it from the layers below."}
_PRESENT: Schema = {"not": _EMPTY, "errorMessage": "must not be empty"}
_NOT_NEEDED = ("required", "minProperties", "minItems")
_NOTES = ("description", "default", "x-names", "x-dimension")  # what editors expect at the key itself


def laid_over(definitions: Mapping[str, Schema]) -> dict[str, Schema]:
    """Return the definitions of a robot, which include its sections, as changes and as wholes."""
    definitions = {**quantities(), **definitions}
    whole = {f"{WHOLE}{name}": schema for name, schema in _wholes(definitions).items()}
    changes = {name: _loose(definition) for name, definition in definitions.items()}
    for section in all_sections():
        if section.short and section.short.only_over:
            word = {"type": ["string", "number", "boolean", "array"], "description": section.short.only_over}
            entry = changes[f"{SECTION}{section.name}"]["additionalProperties"]
            changes[f"{SECTION}{section.name}"]["additionalProperties"] = {"anyOf": [word, entry]}
    entry = changes[f"{SECTION}{components.name}"]["additionalProperties"]["anyOf"][0]
    entry["allOf"] = [*entry["allOf"], _untyped(definitions)]
    removable = {f"{name}{OR_REMOVED}": _removable(name, change) for name, change in changes.items()}
    return {**changes, **whole, **removable, REMOVED: _REMOVED, PRESENT: _PRESENT}


def _untyped(definitions: Mapping[str, Schema]) -> Schema:
    """Return the keys of a component that does not repeat its type, one that users list, for completion."""
    known = [name for name in definitions if name.startswith(COMPONENT)]
    keys = {key for name in known for key in definitions[name]["properties"]} - {TYPE, *OPTIONS}
    return {"if": {"not": {"anyOf": [{"required": [TYPE]}]}}, "then": {"properties": dict.fromkeys(sorted(keys), True)}}


def or_removed(schema: Schema) -> Schema:
    """Return the schema of something that an overlay may also remove."""
    if "$ref" in schema:
        return {**schema, "$ref": schema["$ref"] + OR_REMOVED}
    notes = {key: schema[key] for key in _NOTES if key in schema}
    rest = {key: value for key, value in schema.items() if key not in notes}
    choices = rest["anyOf"] if rest.keys() == {"anyOf"} else rest["allOf"] if rest.keys() == {"allOf"} else [rest]
    return {"anyOf": [*choices, {"$ref": f"{DEFINITIONS}{REMOVED}"}], **notes}


def _removable(name: str, schema: Schema) -> Schema:
    made = or_removed({"anyOf": [{"$ref": f"{DEFINITIONS}{name}"}]})
    samples = schema.get("examples", ()) if not schema.keys() & {"properties", "allOf"} else ()
    # Editors write the default of a key, or its only example, into the file; of two they choose none.
    return {**made, "examples": [*samples, *samples]} if samples else made


def _loose(schema: Schema) -> Schema:
    """Return a schema whose keys may be omitted or removed, at any depth."""
    made: dict[str, Any] = {}
    for key, value in schema.items():
        match key:
            case "properties":
                made[key] = {
                    name: entry if entry is True else or_removed(_loose(entry)) for name, entry in value.items()
                }
            case "additionalProperties" if isinstance(value, dict):
                made[key] = or_removed(_loose(value))
            case "allOf" | "anyOf":
                made[key] = [_loose(item) for item in value]
            case "then" | "items" if isinstance(value, dict):
                made[key] = _loose(value)
            case _ if key not in _NOT_NEEDED:
                made[key] = value
    return made


def _wholes(definitions: Mapping[str, Schema]) -> dict[str, Schema]:
    """Return the definitions that differ from the changes to them, which all others refer to."""
    changed = {name for name, definition in definitions.items() if _loose(definition) != definition}
    while more := {name for name, definition in definitions.items() if changed & {*references(definition)}} - changed:
        changed |= more
    names = {f"{DEFINITIONS}{name}": f"{DEFINITIONS}{WHOLE}{name}" for name in changed}
    return {name: _whole(name, definitions, names) for name in sorted(changed)}


def _whole(name: str, definitions: Mapping[str, Schema], names: Mapping[str, str]) -> Schema:
    schema = definitions[name]
    if schema.get("additionalProperties") is not False:
        return dict(renamed(schema, names))
    options = definitions[f"{SECTION}{components.name}"]["additionalProperties"]["properties"]
    own = {
        key: _bare(renamed(property_, names))
        for key, property_ in schema["properties"].items()
        if _may_be_empty(options[key] if property_ is True else property_, definitions)
        or (property_ is not True and (_loose(property_) != property_ or renamed(property_, names) != property_))
    }
    needed = {key: schema[key] for key in _NOT_NEEDED if key in schema}
    reference = {"allOf": [{"$ref": f"{DEFINITIONS}{name}"}]}
    return {**reference, **needed, "properties": own, "additionalProperties": {"$ref": f"{DEFINITIONS}{PRESENT}"}}


def _bare(schema: Any) -> Any:
    """Return a schema without its notes, which are those of the changes."""
    return schema if schema is True else {key: entry for key, entry in schema.items() if key not in _NOTES}


def renamed(schema: Any, names: Mapping[str, str]) -> Any:
    """Return a schema that refers to other definitions."""
    if isinstance(schema, list):
        return [renamed(item, names) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {key: names.get(entry, entry) if key == "$ref" else renamed(entry, names) for key, entry in schema.items()}


def _may_be_empty(schema: Schema, definitions: Mapping[str, Schema]) -> bool:
    """Return whether a schema accepts `null` or an empty text."""
    if "$ref" in schema:
        return _may_be_empty(definitions[schema["$ref"].removeprefix(DEFINITIONS)], definitions)
    if "anyOf" in schema:
        return any(_may_be_empty(one, definitions) for one in schema["anyOf"])
    if "enum" in schema:
        return False
    types = schema.get("type", "null")
    is_text = (
        "string" in types
        and not schema.get("minLength")
        and re.compile(schema.get("pattern", "")).search("") is not None
    )
    return "null" in types or is_text


def references(schema: Any) -> Iterator[str]:
    """Yield the names of the definitions that a schema refers to."""
    match schema:
        case {"$ref": str(reference)}:
            yield reference.removeprefix(DEFINITIONS).partition("/")[0]
        case dict():
            for inner in schema.values():
                yield from references(inner)
        case list():
            for inner in schema:
                yield from references(inner)
