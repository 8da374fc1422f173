"""The schema of controllers: one per type, from its configuration."""

from __future__ import annotations

import inspect
from typing import Any

from rbxcompose.controller_interface import controller_names, controller_type
from rbxcompose.schema.scalars import DEFINITIONS, Schema
from rbxcompose.schema.settle import opened, schemas_of

TYPE_HELP = "How it leads its joints: the name of a type of controllers."
PREFIX = "controller_"  # of the definition of a type
_EXAMPLE = "Example:"


def controller_schemas() -> tuple[Schema, dict[str, Schema]]:
    """Return the schema of one entry of `controllers`, and the definitions that it needs: one for each type."""
    names = controller_names()
    wanted: dict[str, Any] = {name: controller_type(name).config_type() for name in names}
    schemas, definitions = schemas_of(wanted)
    for name, schema in schemas.items():
        definitions[f"{PREFIX}{name}"] = {**opened(schema, definitions), "description": about_controller(name)}
    about = [about_controller(name) for name in names]
    word = {"type": "string", "enum": names, "enumDescriptions": about, "description": TYPE_HELP}
    chosen = [
        {
            "if": {"properties": {"type": {"const": name}}, "required": ["type"]},
            "then": {"$ref": f"{DEFINITIONS}{PREFIX}{name}"},
        }
        for name in names
    ]
    entry = {"type": "object", "required": ["type"], "properties": {"type": word}, "allOf": chosen}
    return entry, definitions


def about_controller(name: str) -> str:
    """Return the description of a type: its docstring up to the example, as one paragraph."""
    text = inspect.getdoc(controller_type(name)) or ""
    return " ".join(text.partition(_EXAMPLE)[0].split())
