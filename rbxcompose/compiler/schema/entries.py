"""Schemas of entries that name their type, such as components: one per type, from its configuration."""

import inspect
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any

from rbxcompose.base.config import field_docs
from rbxcompose.compiler.schema.scalars import DEFINITIONS, Schema
from rbxcompose.compiler.schema.settle import opened, schemas_of
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.section import ComponentOptions, Section
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.sdk.registry import component_type

TYPE = "type"
COMPONENT = "component_"  # prefix of the definition of a type
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
