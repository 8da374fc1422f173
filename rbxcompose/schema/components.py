"""Schemas of components: one per type, from its configuration and the options that every component takes."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any

from rbxcompose.manifest.options import ComponentOptions
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.schema.scalars import DEFINITIONS, Schema
from rbxcompose.schema.settle import opened, schemas_of
from rbxcompose.sdk.registry import component_type

TYPE_HELP = "What runs: the name of a component type."
TYPE = "type"
COMPONENT = "component_"  # prefix of the definition of a type
_EXAMPLE = "Example:"


def component_schemas(types: Iterable[str]) -> tuple[Schema, dict[str, Schema]]:
    """Return the schema of one entry of `components`, and the definitions that it needs: one for each type."""
    names = sorted(types)
    wanted: dict[str, Any] = {name: component_type(name).config_type() for name in names}
    schemas, definitions = schemas_of({**wanted, "": ComponentOptions})
    options = opened(schemas.pop(""), definitions)["properties"]
    for name, schema in schemas.items():
        definitions[f"{COMPONENT}{name}"] = _component(name, opened(schema, definitions), options)
    word = {"enum": names, "enumDescriptions": [about_type(name) for name in names]}
    return _entry(names, options), {**definitions, TYPE: word}


def _entry(names: list[str], options: Schema) -> Schema:
    chosen = [
        {
            "if": {"properties": {"type": {"const": name}}, "required": ["type"]},
            "then": {"$ref": f"{DEFINITIONS}{COMPONENT}{name}"},
        }
        for name in names
    ]
    word = {"anyOf": [{"$ref": f"{DEFINITIONS}{TYPE}"}], "description": TYPE_HELP}
    return {
        "description": "What runs under this name: its `type`, and the configuration of that type.",
        "type": "object",
        "required": ["type"],
        "properties": {TYPE: word, **options},
        "allOf": chosen,
    }


def _component(name: str, config: Schema, options: Mapping[str, Any]) -> Schema:
    """Return the schema of a type: its own settings, plus the keys that every entry may have."""
    return {
        "description": about_type(name),
        "type": "object",
        "properties": {TYPE: True, **config.get("properties", {}), **dict.fromkeys(options, True)},
        "required": ["type", *config.get("required", [])],
        "additionalProperties": False,
        "examples": examples_of(name),
    }


def about_type(name: str) -> str:
    """Return the description of a component type: its docstring up to the example, as one paragraph."""
    text = inspect.getdoc(component_type(name)) or ""
    return " ".join(text.partition(_EXAMPLE)[0].split())


def examples_of(name: str) -> list[object]:
    """Return the configurations that a type's docstring shows."""
    text = textwrap.dedent((inspect.getdoc(component_type(name)) or "").partition(_EXAMPLE)[2])
    node, _ = read_text(text, name) if text.strip() else (None, [])
    return [to_plain(entry.value) for entry in node.entries.values()] if isinstance(node, MappingNode) else []
