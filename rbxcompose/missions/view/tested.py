"""What tests have tried of a mission, kept for who looks at it: written by `test --coverage`, read by the console.

One file for each robot of a user, below `$XDG_STATE_HOME/rbxcompose/coverage`.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rbxcompose.base.files import replace_file, state_folder


def keep_tested(robot: str, missions: Mapping[str, Mapping[str, Any]]) -> None:
    """Keep what is known of some missions of a robot: `at` [s since 1970], `tests`, `ways`, `count` and `missing`.

    `count` is how many nodes the mission had; of each way that is `missing` there are its `node` and its `text`.

    Raises:
        OSError: if it cannot be written.
    """
    path = _path(robot)
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, json.dumps({**_read(path), **missions}).encode())


def read_tested(robot: str, mission: str) -> Mapping[str, Any] | None:
    """Return what is known of a mission; None if it was not tested."""
    known = _read(_path(robot)).get(mission)
    return known if isinstance(known, dict) else None


def _path(robot: str) -> Path:
    return state_folder() / "coverage" / f"{robot}.json"


def _read(path: Path) -> dict[str, Any]:
    try:
        known = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}  # it is made anew
    return known if isinstance(known, dict) else {}
