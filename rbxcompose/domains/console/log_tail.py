"""The robot's log for pages: the newest records, then what was added since; and what `check` found before."""

import json
from pathlib import Path
from typing import Any

MOST = 500  # records at once
_LEVELS = {"OK": "info", "WARN": "warning"}  # others are errors
_MOST_BYTES = 256 * 1024  # that are read of a log, from its end


def tail(path: Path, after: int) -> dict[str, Any]:
    """Return the records behind `after`, a place that an earlier answer named, at most the newest; and the next place.

    A log that was begun anew is read from its beginning; lines that are not whole yet are left for the next time.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            start = after if 0 <= after <= size else 0
            first = max(start, size - _MOST_BYTES)
            file.seek(first)
            data = file.read(size - first)
    except FileNotFoundError:
        return {"records": [], "after": 0}
    if first > start:  # within a line
        data = data[data.find(b"\n") + 1 :]
    whole, _, rest = data.rpartition(b"\n")
    records = [shown for line in whole.split(b"\n") if (shown := _shown(line)) is not None]
    return {"records": records[-MOST:], "after": size - len(rest)}


def findings(path: Path) -> list[Any]:
    """Return what `check` found when the robot came up: code, severity, file, line, message and help of each."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []  # a share of a system has none
    return found if isinstance(found, list) else []


def _shown(line: bytes) -> dict[str, Any] | None:
    """Return a record, as `runtime.log` writes it; None for a line that a full disk has torn."""
    try:
        fields = json.loads(line)
        level = _LEVELS.get(fields["level"], "error")
        shown = {"time": float(fields["t"]), "level": level, "source": fields["source"], "text": fields["text"]}
    except (ValueError, KeyError, TypeError):
        return None
    return shown | ({"detail": fields["detail"]} if fields.get("detail") else {})
