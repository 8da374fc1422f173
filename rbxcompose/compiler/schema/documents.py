"""The JSON Schema of each kind of manifest, and the files in `schemas/` that editors read.

`python -m rbxcompose.compiler.schema.documents FOLDER` writes them; a test fails when one is out of date.
"""

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Annotated, Any, get_type_hints

from rbxcompose.base.config import NAMES, PLACE, Name, Refers, Time, field_docs
from rbxcompose.base.files import replace_file
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.schema.mission import mission_schema, skills_for
from rbxcompose.compiler.schema.robot import document, or_empty, overlay_schema, part_schema, robot_schema
from rbxcompose.compiler.schema.scalars import DEFINITIONS, SHARED, Schema, opened, schemas_of
from rbxcompose.compiler.sections.composition import PROFILE
from rbxcompose.compiler.sections.missions import MissionName
from rbxcompose.manifest import system_file, test_file
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT, SYSTEM, TEST
from rbxcompose.msgs.registry import Types, chosen
from rbxcompose.sdk import registry

STEP = "step"
WORDS: dict[str, Any] = {
    "robot": FileName,
    "also": list[FileName],
    "profile": Annotated[Name, Refers(PROFILE, is_reported=True)],
    "mission": MissionName,
    "with": dict[Name, Any],
}
_ABOUT = {
    STEP: "A skill, a named node or a state; a skill may be followed by its main argument, or a map of its arguments.",
    "ended": "How it ended: `success`, `failure`, `halted`, `skipped`, `running`, or an outcome of its own.",
    "at": "When it started, counted from the start of the test.",
}
_WIDTH = 120  # of a line in a file


def system_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a system; it is the same for all types of components."""
    own = system_file.SystemFile.model_fields.keys() - ManifestHeader.model_fields.keys()
    hints = get_type_hints(system_file.SystemFile, include_extras=True)
    keys = {name: hint for name, hint in hints.items() if name in own and hint is not Any}
    schemas, definitions = schemas_of({**system_file.SECTIONS, **system_file.LINKS, **system_file.PROFILES, **keys})
    about = field_docs(system_file.SystemFile)
    sections = {
        key: {**or_empty(opened(schema, definitions)), "description": about[key]} for key, schema in schemas.items()
    }
    whole = document(SYSTEM, system_file.SystemFile, sections, definitions)
    return {**whole, "required": [*whole["required"], *system_file.SECTIONS]}


def trial_schema(types: Iterable[str]) -> Schema:
    """Return the schema of a test; it is the same for all types of components."""
    schemas, definitions = schemas_of({**WORDS, **test_file.SECTIONS, "at": Time})
    sections = {key: or_empty(opened(schemas[key], definitions)) for key in (*WORDS, *test_file.SECTIONS)}
    steps: Schema = {"type": "array", "items": {"$ref": f"{DEFINITIONS}{STEP}"}}
    expect = sections["expect"]
    about = {key: expect["properties"][key]["description"] for key in ("steps", "never")}
    described = {key: {**steps, "description": text} for key, text in about.items()}
    sections["expect"] = {**expect, "properties": {**expect["properties"], **described}}
    made = {name: {**sections[name], "description": _description(name)} for name in sections}
    whole = document(TEST, test_file.TrialFile, made, {**definitions, STEP: _step(schemas["at"])})
    return {**whole, "required": [*whole["required"], "robot", "mission", "expect"]}


def _description(name: str) -> str:
    fields = test_file.TrialFile.model_fields
    return next(field_docs(test_file.TrialFile)[key] for key, field in fields.items() if name in (key, field.alias))


def _step(time: Schema) -> Schema:
    properties = {
        "ended": {"type": "string", "description": _ABOUT["ended"]},
        "at": {**time, "description": _ABOUT["at"]},
    }
    mapping = {"properties": properties, "minProperties": 1, "maxProperties": 1 + len(properties)}
    argument = {"additionalProperties": {NAMES: PLACE}}
    return {"type": ["string", "object"], "minLength": 1, **mapping, **argument, "description": _ABOUT[STEP]}


def own_schema(kind: str, model: type[ManifestHeader], types: Iterable[str]) -> Schema:
    """Return the schema of a kind of manifest that a section has for itself; it is the same for all types."""
    schemas, definitions = schemas_of({kind: model})
    properties = opened(schemas[kind], definitions)["properties"]
    own = {name: schema for name, schema in properties.items() if name not in ManifestHeader.model_fields}
    return document(kind, model, own, definitions)


@cache
def makers() -> Mapping[str, Callable[[Iterable[str]], Schema]]:
    """Return for each kind of manifest what makes its schema from the names of component types."""
    own = {
        kind: partial(own_schema, kind, model) for section in sections() for kind, model in section.documents.items()
    }
    return {
        "Robot": robot_schema,
        "Part": part_schema,
        "Overlay": overlay_schema,
        "Mission": mission_schema,
        "Test": trial_schema,
        "System": system_schema,
        **own,
    }


def installed_schema(kind: str) -> Schema:
    """Return the schema of a kind of manifest with all installed component types; it must not be modified.

    Those that import message types of a robot are among them while these are chosen.
    """
    return schema_with(kind, chosen())


@lru_cache(64)
def schema_with(kind: str, types: Types) -> Schema:
    """Return what `installed_schema` does, while these message types are chosen."""
    return makers()[kind](registry.usable_names())


def schema_for(kind: str, robot: Robot | None) -> Schema:
    """Return the schema of a kind of manifest for a robot, if one is known; it must not be modified."""
    if robot is None or kind != "Mission":
        return installed_schema(kind)
    return mission_schema(registry.usable_names(), skills_for(robot))


def as_text(schema: Schema) -> str:
    """Return a schema as the text of its file: a line for each key or definition that fits on one."""
    return _text(schema) + "\n"


def _text(value: Any) -> str:
    flat = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    if len(flat) <= _WIDTH or not value or not isinstance(value, dict | list):
        return flat
    if isinstance(value, dict):
        return "{\n" + ",\n".join(f"{json.dumps(key)}:{_text(entry)}" for key, entry in value.items()) + "\n}"
    return "[\n" + ",\n".join(map(_text, value)) + "\n]"


def files() -> dict[str, str]:
    """Return the file name and text of each schema, with the component types that ship with the package.

    Those of parts and overlays refer to the definitions in that of robots, which is beside them.
    """
    shipped = sorted(registry.PLUGINS.shipped)
    schemas = {kind: make(shipped) for kind, make in makers().items()}
    for kind in (PART, OVERLAY):
        schemas[kind] = _beside(schemas[kind], schemas[ROBOT][SHARED])
    return {_file(kind): as_text(schema) for kind, schema in schemas.items()}


def _file(kind: str) -> str:
    return f"{kind.lower()}.schema.json"


def _beside(schema: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return a schema that refers to the definitions of a robot's instead of having them itself."""
    own = {name: entry for name, entry in schema[SHARED].items() if definitions.get(name) != entry}
    there = {f"{DEFINITIONS}{name}": f"{_file(ROBOT)}{DEFINITIONS}{name}" for name in definitions if name not in own}
    made: Schema = _renamed({**schema, SHARED: own}, there)
    return made if own else {key: entry for key, entry in made.items() if key != SHARED}


def _renamed(schema: Any, names: Mapping[str, str]) -> Any:
    """Return a schema that refers to other definitions."""
    if isinstance(schema, list):
        return [_renamed(item, names) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {key: names.get(entry, entry) if key == "$ref" else _renamed(entry, names) for key, entry in schema.items()}


def main(folder: Path) -> None:
    """Write all schemas into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files().items():
        replace_file(folder / name, text.encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
