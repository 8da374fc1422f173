"""The JSON Schema of each kind of manifest, and the files in `schemas/` that editors read.

`python -m rbxcompose.schema.documents FOLDER` writes them; a test fails when one is out of date.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from rbxcompose.atomic_files import replace_file
from rbxcompose.missions.program.program import Skill
from rbxcompose.schema.mission import mission_schema
from rbxcompose.schema.robot import overlay_schema, part_schema, robot_schema
from rbxcompose.schema.scalars import Schema
from rbxcompose.schema.system import system_schema
from rbxcompose.schema.trial import trial_schema
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
    """Return a schema as the text of its file: anything that fits on one line does, so that diffs are short."""
    return _text(schema, 0) + "\n"


def _text(value: Any, depth: int) -> str:
    flat = json.dumps(value, ensure_ascii=False)
    if len(flat) + depth <= _WIDTH or not value or not isinstance(value, dict | list):
        return flat
    depth += 1
    if isinstance(value, dict):
        items = [f"{json.dumps(key)}: {_text(one, depth)}" for key, one in value.items()]
    else:
        items = [_text(one, depth) for one in value]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    inside = f",\n{' ' * depth}".join(items)
    return f"{opening}\n{' ' * depth}{inside}\n{' ' * (depth - 1)}{closing}"


def files() -> dict[str, str]:
    """Return the file name and text of each schema, with the component types that ship with the package."""
    shipped = sorted(registry.PLUGINS.shipped)
    return {f"{kind.lower()}.schema.json": as_text(make(shipped)) for kind, make in MAKERS.items()}


def main(folder: Path) -> None:
    """Write all schemas into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files().items():
        replace_file(folder / name, text.encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
