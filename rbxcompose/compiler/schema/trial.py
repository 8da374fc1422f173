"""Schema of a test file: its sections are models, its steps are names in the mission."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rbxcompose.base.config import Name, Time, field_docs
from rbxcompose.compiler.schema.robot import document, or_empty
from rbxcompose.compiler.schema.scalars import DEFINITIONS, Schema
from rbxcompose.compiler.schema.settle import opened, schemas_of
from rbxcompose.manifest.section import TEST
from rbxcompose.manifest.test_file import SECTIONS, TrialFile

STEP = "step"
WORDS: dict[str, Any] = {"robot": str, "also": list[str], "profile": Name, "mission": Name, "with": dict[Name, Any]}
_ABOUT = {
    STEP: "A skill, a named node or a state; a skill may be followed by its main argument, or a map of its arguments.",
    "ended": "How it ended: `success`, `failure`, `halted`, `skipped`, `running`, or an outcome of its own.",
    "at": "When it started, counted from the start of the test.",
}


def trial_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a test; it is the same for all types of components."""
    schemas, definitions = schemas_of({**WORDS, **SECTIONS, "at": Time})
    sections = {key: or_empty(opened(schemas[key], definitions)) for key in (*WORDS, *SECTIONS)}
    steps: Schema = {"type": "array", "items": {"$ref": f"{DEFINITIONS}{STEP}"}}
    expect = sections["expect"]
    about = {key: expect["properties"][key]["description"] for key in ("steps", "never")}
    told = {key: {**steps, "description": text} for key, text in about.items()}
    sections["expect"] = {**expect, "properties": {**expect["properties"], **told}}
    made = {name: {**sections[name], "description": _description(name)} for name in sections}
    whole = document(TEST, TrialFile, made, {**definitions, STEP: _step(schemas["at"])})
    return {**whole, "required": [*whole["required"], "robot", "mission", "expect"]}


def _description(name: str) -> str:
    fields = TrialFile.model_fields
    return next(field_docs(TrialFile)[key] for key, field in fields.items() if name in (key, field.alias))


def _step(time: Schema) -> Schema:
    properties = {
        "ended": {"type": "string", "description": _ABOUT["ended"]},
        "at": {**time, "description": _ABOUT["at"]},
    }
    mapping = {"properties": properties, "minProperties": 1, "maxProperties": 1 + len(properties)}
    return {"type": ["string", "object"], "minLength": 1, **mapping, "description": _ABOUT[STEP]}
