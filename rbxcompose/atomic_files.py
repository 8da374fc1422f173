"""Replacing a file atomically: completely or not at all, even if the write is interrupted."""

from __future__ import annotations

import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

TEMPORARY = ".new"  # marks a file that has not replaced its target yet


def replace_file(path: Path, data: bytes, *, mode: int | None = None) -> None:
    """Create or replace a file. An existing file keeps its mode; a new one gets `mode`, or the default for new files.

    Raises:
        OSError: if it cannot be written; the old file is then unchanged.
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
        with suppress(OSError):  # the original error is reported, not this one
            os.unlink(temporary)
        raise
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Flush a folder to disk, so that its entries survive a power failure."""
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
