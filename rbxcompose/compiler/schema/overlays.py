"""What an overlay writes of a section, where every key may be omitted or removed, and what a whole section has.

A definition describes changes, and `whole_` before its name what a complete one has beyond that: what must be there. So
each key is described once, and a complete one has to satisfy both.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.compiler.schema.scalars import COMPONENT, DEFINITIONS, TYPE, Schema, quantities
from rbxcompose.compiler.sections.components import components
from rbxcompose.manifest.registry import sections as all_sections
from rbxcompose.manifest.section import OPTIONS

WHOLE = "whole_"  # prefix of what a definition demands where keys may neither be removed nor, if required, omitted
SECTION = "section_"  # prefix of the definition of a section
REMOVED = "removed"
OR_REMOVED = "_or_no"  # suffix of a definition to which that is added
PRESENT, NULLABLE = "present", "nullable"
_PRESENCE: Schema = {"$ref": f"{DEFINITIONS}{PRESENT}"}
# No `enum` or `type`: editors would propose `null` and `""` as values of every key.
_EMPTY: Schema = {"maxLength": 0, "not": {"type": ["number", "boolean", "object", "array"]}}
_REMOVED: Schema = {**_EMPTY, "description": "With the tag `!remove`: removes it from the layers below."}
_PRESENT: Schema = {"not": _EMPTY, "errorMessage": "must not be empty"}
_NULLABLE: Schema = {"type": ["string", "number", "boolean", "object", "array", "null"], "minLength": 1}
_NULL, _BLANK = "null", "blank"
_DEMANDS: dict[tuple[bool, bool], Any] = {  # by whether the value may be null or an empty text, as removed ones are
    (False, False): _PRESENCE,
    (True, False): {"$ref": f"{DEFINITIONS}{NULLABLE}"},
    (False, True): {"not": {"type": "null"}},
    (True, True): True,
}
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
            demanded = whole[f"{WHOLE}{SECTION}{section.name}"]
            demanded["additionalProperties"] = {"type": "object", "allOf": [demanded["additionalProperties"]]}
    entry = changes[f"{SECTION}{components.name}"]["additionalProperties"]["anyOf"][0]
    entry["allOf"] = [*entry["allOf"], _untyped(definitions)]
    removable = {f"{name}{OR_REMOVED}": _removable(name, change) for name, change in changes.items()}
    return {**changes, **whole, **removable, REMOVED: _REMOVED, PRESENT: _PRESENT, NULLABLE: _NULLABLE}


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
    """Return what the definitions demand beyond the changes to them, of those that demand more."""
    changed = {name for name, definition in definitions.items() if _loose(definition) != definition}
    while more := {name for name, definition in definitions.items() if changed & {*references(definition)}} - changed:
        changed |= more
    made = _Whole(definitions, {f"{DEFINITIONS}{name}": f"{DEFINITIONS}{WHOLE}{name}" for name in changed})
    return {name: made.beyond(definitions[name]) for name in sorted(changed)}


class _Whole:
    """What a schema demands beyond the change to it: that nothing is missing, and nothing removed.

    `names` are the references to definitions that demand more, and what takes their place. `True` is no demand.
    """

    def __init__(self, definitions: Mapping[str, Schema], names: Mapping[str, str]) -> None:
        self._definitions = definitions
        self._names = names
        self._options = definitions[f"{SECTION}{components.name}"]["additionalProperties"]["properties"]

    def beyond(self, schema: Any) -> Any:
        """Return the demands of one schema: of its structure, or that it is there."""
        needed = {key: schema[key] for key in _NOT_NEEDED if key in schema}
        typed = {**({"type": schema["type"]} if "type" in schema else {}), **needed}
        match schema:
            case {"$ref": str(reference)} if reference in self._names:
                return {"$ref": self._names[reference]}
            case {"anyOf": members}:
                found = [self.beyond(member) for member in members]
                if shapes := [demand for demand in found if _is_shape(demand)]:
                    others = [one for one, demand in zip(members, found, strict=True) if not _is_shape(demand)]
                    return {"anyOf": [*shapes, *([self._outline({"anyOf": others})] if others else [])]}
            case {"properties": properties}:
                return {**typed, **self._keys(schema, properties)}
            case {"additionalProperties": dict(entry)} if (inner := self.beyond(entry)) is not True or needed:
                return {**typed, "additionalProperties": inner}
            case {"items": dict(entry)} if _is_shape(inner := self.beyond(entry)):
                return {**typed, "items": inner}
            case _ if needed:
                return typed
        accepted = _accepted(schema, self._definitions)
        return _DEMANDS[_NULL in accepted, _BLANK in accepted]

    def _outline(self, schema: Schema) -> Schema:
        """Return which types of values a schema accepts; the change says the rest."""
        accepted = _accepted(schema, self._definitions)
        return {"type": sorted(accepted - {_BLANK}), **({} if _BLANK in accepted else {"minLength": 1})}

    def _keys(self, schema: Schema, properties: Mapping[str, Any]) -> Schema:
        """Return what is demanded of the keys of a map: of each by itself, where that is not just to be there."""
        if schema.get("additionalProperties") is not False:
            chosen = [{**one, "then": self.beyond(one["then"])} for one in schema.get("allOf", ())]
            demands = {key: self.beyond(entry) for key, entry in properties.items()}
            return {
                "properties": {key: demand for key, demand in demands.items() if demand is not True},
                "allOf": [one for one in chosen if _is_shape(one["then"])],
            }
        own = {}
        for key, entry in properties.items():
            demand = self.beyond(self._options.get(key, {}) if entry is True else entry)
            if demand != _PRESENCE:
                own[key] = True if entry is True else demand  # of an option, the entry demands the rest
        return {"properties": own, "additionalProperties": _PRESENCE}


def _is_shape(demand: Any) -> bool:
    return demand not in _DEMANDS.values()


def _accepted(schema: Any, definitions: Mapping[str, Schema]) -> set[str]:
    """Return the JSON types of the values that a schema accepts, and whether an empty text is one of them."""
    if "$ref" in schema:
        return _accepted(definitions[schema["$ref"].removeprefix(DEFINITIONS)], definitions)
    if "anyOf" in schema:
        return set().union(*(_accepted(one, definitions) for one in schema["anyOf"]))
    if "enum" in schema:
        return {"string"}
    types = schema.get("type", _NULLABLE["type"])
    found = {types} if isinstance(types, str) else {*types}
    is_long = schema.get("minLength") or not re.compile(schema.get("pattern", "")).search("")
    return found if is_long or "string" not in found else found | {_BLANK}


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
