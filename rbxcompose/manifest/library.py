"""The robots, missions and parts that ship with the package, named `rbx:...`."""

from __future__ import annotations

from pathlib import Path

PREFIX = "rbx:"
PARTS = "parts"  # the library's folder of parts
_PACKAGE = Path(__file__).resolve().parent.parent


def library_root() -> Path:
    """Return the folder that `rbx:` refers to: inside the installed package, or beside it in a checkout."""
    inside = _PACKAGE / "library"
    return inside if inside.is_dir() else _PACKAGE.parent
