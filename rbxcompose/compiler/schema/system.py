"""Schema of a system's file."""

from __future__ import annotations

from collections.abc import Iterable

from rbxcompose.base.config import field_docs
from rbxcompose.compiler.schema.robot import document, or_empty
from rbxcompose.compiler.schema.scalars import Schema
from rbxcompose.compiler.schema.settle import opened, schemas_of
from rbxcompose.manifest.section import SYSTEM
from rbxcompose.manifest.system_file import LINKS, PROFILES, SECTIONS, SECURITY, SystemFile


def system_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a system; it is the same for all types of components."""
    keys = {name: field.annotation for name, field in SystemFile.model_fields.items() if name == SECURITY}
    schemas, definitions = schemas_of({**SECTIONS, **LINKS, **PROFILES, **keys})
    about = field_docs(SystemFile)
    sections = {
        key: {**or_empty(opened(schema, definitions)), "description": about[key]} for key, schema in schemas.items()
    }
    whole = document(SYSTEM, SystemFile, sections, definitions)
    return {**whole, "required": [*whole["required"], *SECTIONS]}
