"""Which kind of manifest a path names, by the start of the file; apart from what reads manifests, which is heavy."""

from __future__ import annotations

import re
from pathlib import Path

from rbxcompose.regular_files import open_regular

_KIND = re.compile(rb"^kind:[ \t]*['\"]?(\w+)", re.MULTILINE)
_HEAD = 4096  # bytes at the start of a file that contain its kind


def kind_of(path: Path) -> str:
    """Return the kind that a manifest names; empty if it names none or cannot be read."""
    try:
        with open_regular(path) as file:
            found = _KIND.search(file.read(_HEAD))
    except OSError:
        return ""
    return found[1].decode() if found else ""


def is_system(written: str) -> bool:
    """Return whether a command-line path names the file of a system."""
    return Path(written).is_file() and kind_of(Path(written)) == "System"


def system_and_robot(written: str) -> tuple[str, str] | None:
    """Return the system's file and the robot that `FILE` or `FILE:ROBOT` names; without a robot, all are meant."""
    if is_system(written):
        return written, ""
    path, _, robot = written.rpartition(":")
    return (path, robot) if path and is_system(path) else None
