"""The JSON Schema of each kind of manifest, and the files in `schemas/` that editors read.

`python -m rbxcompose.compiler.schema.documents FOLDER` writes them; a test fails when one is out of date.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from rbxcompose.base.files import replace_file
from rbxcompose.compiler.schema.mission import mission_schema
from rbxcompose.compiler.schema.overlays import renamed
from rbxcompose.compiler.schema.robot import overlay_schema, part_schema, robot_schema
from rbxcompose.compiler.schema.scalars import DEFINITIONS, SHARED, Schema
from rbxcompose.compiler.schema.system import system_schema
from rbxcompose.compiler.schema.trial import trial_schema
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT
from rbxcompose.missions.program.program import Skill
from rbxcompose.sdk import registry

MAKERS: Mapping[str, Callable[[Iterable[str]], Schema]] = {
    "Robot": robot_schema,
    "Part": part_schema,
    "Overlay": overlay_schema,
    "Mission": mission_schema,
    "Test": trial_schema,
    "System": system_schema,
}
"""Makes the schema of a kind from the names of component types."""

_WIDTH = 120  # of a line in a file


@cache
def installed_schema(kind: str) -> Schema:
    """Return the schema of a kind of manifest with all installed component types; it must not be modified."""
    return MAKERS[kind](registry.usable_names())


def schema_for(kind: str, skills: Mapping[str, Skill]) -> Schema:
    """Return the schema of a kind of manifest for a robot with these skills; it must not be modified."""
    return mission_schema(registry.usable_names(), skills) if skills and kind == "Mission" else installed_schema(kind)


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
    schemas = {kind: make(shipped) for kind, make in MAKERS.items()}
    for kind in (PART, OVERLAY):
        schemas[kind] = _beside(schemas[kind], schemas[ROBOT][SHARED])
    return {_file(kind): as_text(schema) for kind, schema in schemas.items()}


def _file(kind: str) -> str:
    return f"{kind.lower()}.schema.json"


def _beside(schema: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return a schema that refers to the definitions of a robot's instead of having them itself."""
    own = {name: entry for name, entry in schema[SHARED].items() if definitions.get(name) != entry}
    there = {f"{DEFINITIONS}{name}": f"{_file(ROBOT)}{DEFINITIONS}{name}" for name in definitions if name not in own}
    made: Schema = renamed({**schema, SHARED: own}, there)
    return made if own else {key: entry for key, entry in made.items() if key != SHARED}


def main(folder: Path) -> None:
    """Write all schemas into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files().items():
        replace_file(folder / name, text.encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
