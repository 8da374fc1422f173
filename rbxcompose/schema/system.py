"""Schema of a system's file."""

from __future__ import annotations

from collections.abc import Iterable

from rbxcompose.field_docs import field_docs
from rbxcompose.manifest.section import SYSTEM
from rbxcompose.manifest.system_file import LINKS, PROFILES, SECTIONS, SECURITY, SystemFile
from rbxcompose.schema.robot import document, or_empty
from rbxcompose.schema.scalars import Schema
from rbxcompose.schema.settle import opened, schemas_of


def system_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a system; it is the same for all types of components."""
    keys = {name: field.annotation for name, field in SystemFile.model_fields.items() if name == SECURITY}
    schemas, definitions = schemas_of({**SECTIONS, **LINKS, **PROFILES, **keys})
    about = field_docs(SystemFile)
    sections = {key: {**or_empty(opened(one, definitions)), "description": about[key]} for key, one in schemas.items()}
    whole = document(SYSTEM, SystemFile, sections, definitions)
    return {**whole, "required": [*whole["required"], *SECTIONS]}
