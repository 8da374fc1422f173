"""The log of all that clients have called: one line of JSON for each call, in the state folder."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import state_folder
from rbxcompose.base.printable import plain
from rbxcompose.runtime.log import LogFile

NAME = "mcp.jsonl"
TEXTS = "unsaved"  # the argument with whole texts
_MOST = 30  # arguments, and entries of one
_WORDS = 200  # characters of a text


@dataclass(frozen=True, slots=True)
class AuditedCall:
    """A call: when it ended [s since the epoch], how long it took [s], who called what, and what came of it."""

    time: float
    took: float
    client: str
    project: str
    tool: str
    arguments: Mapping[str, Any]
    result: str

    def to_json(self) -> str:
        """Return it as a line; texts of files are left out."""
        when = datetime.fromtimestamp(self.time, UTC).isoformat(timespec="milliseconds")
        fields = {
            "time": when,
            "client": plain(self.client),
            "project": self.project,
            "tool": plain(self.tool),
            "arguments": {plain(key): _brief(key, value) for key, value in list(self.arguments.items())[:_MOST]},
            "result": plain(self.result),
            "took": round(self.took, 3),
        }
        return json.dumps(fields, ensure_ascii=False)


class AuditLog:
    """Writes calls; old ones go to other files, which are deleted in the end, as those of a robot's log are."""

    def __init__(self) -> None:
        """Open it.

        Raises:
            OSError: if it cannot be written.
        """
        self.path = audit_path()
        self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._file = LogFile(self.path)

    def write(self, client: str, tool: str, arguments: Mapping[str, Any], result: str, took: float) -> None:
        """Add a call that has just ended."""
        self._file.write(AuditedCall(time.time(), took, client, str(Path.cwd()), tool, arguments, result))


def audit_path() -> Path:
    """Return the file with the newest calls."""
    return state_folder() / NAME


def _brief(key: str, value: Any) -> Any:
    """Return an argument shortened; of texts of files, how long they are."""
    if key == TEXTS and isinstance(value, dict):
        return {plain(str(path)): f"{len(str(text)):,} characters" for path, text in list(value.items())[:_MOST]}
    if value is None or isinstance(value, bool | int | float):
        return value
    return plain(value if isinstance(value, str) else json.dumps(value, ensure_ascii=False), _WORDS)
