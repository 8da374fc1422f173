"""Shared memory, through which large messages go between processes of one host without being copied.

Zenoh keeps it in files, each locked (`flock`) by who uses it, and so does what is here.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import time
from pathlib import Path

FOLDER = Path("/dev/shm")  # noqa: S108
POOL = 16 * 1024 * 1024  # [bytes] that a process sets aside for what it sends, once it sends something large
YOUNG = 1.0  # [s]; a newer file may be about to be locked


def problem(folder: Path = FOLDER) -> str:
    """Say why shared memory cannot be used; empty if it can."""
    try:
        room = os.statvfs(folder)
    except OSError:
        return f"there is no {folder}"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"{folder} cannot be written"
    free = room.f_bavail * room.f_frsize
    if free < POOL:
        return f"{folder} has {free / 1e6:.1f} MB free, {POOL / 1e6:.1f} MB are needed"
    return ""


def remove_orphans(folder: Path = FOLDER) -> int:
    """Remove the files of processes that were killed and return how many; those in use stay, whoever uses them."""
    return sum(map(_remove_if_orphan, folder.glob("*.zenoh")))


def _remove_if_orphan(path: Path) -> bool:
    with contextlib.suppress(OSError):  # somebody else's, in use, or gone by now
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
        try:
            if os.fstat(descriptor).st_ctime > time.time() - YOUNG:
                return False
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
            return True
        finally:
            os.close(descriptor)
    return False
