"""Replacing a file: whole or not at all, whatever happens meanwhile."""

from __future__ import annotations

import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

TEMPORARY = ".new"  # ends the name of a file that has not taken its place yet


def replace_file(path: Path, data: bytes, *, mode: int | None = None) -> None:
    """Write a file again, or for the first time. Its mode stays; a new one has `mode`, else what new files have.

    Raises:
        OSError: if it cannot be written; it is as before then.
    """
    mode = _mode_of(path) if mode is None else mode
    descriptor, temporary = tempfile.mkstemp(prefix=f".{path.name}.", suffix=TEMPORARY, dir=path.parent)
    try:
        with open(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fchmod(descriptor, mode)
            os.fsync(descriptor)
        os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):  # what has failed already is told
            os.unlink(temporary)
        raise
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Have the names in a folder survive a loss of power."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _mode_of(path: Path) -> int:
    try:
        mode = stat.S_IMODE(path.stat().st_mode)
    except FileNotFoundError:
        os.umask(umask := os.umask(0o077))
        return 0o666 & ~umask
    if not os.access(path, os.W_OK):
        raise PermissionError(13, "it is not writable")
    return mode
