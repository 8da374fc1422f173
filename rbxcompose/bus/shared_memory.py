"""Shared memory, which passes large messages between processes of one host without copying.

Zenoh keeps it in files, each locked (`flock`) by its users; this module takes the same locks.
"""

import contextlib
import fcntl
import os
import time
from pathlib import Path

FOLDER = Path("/dev/shm")  # noqa: S108
POOL = 16 * 1024 * 1024  # [bytes] that a process sets aside for what it sends, once it sends something large
YOUNG = 0.2  # [s]; a newer file may be about to be locked, which follows its creation immediately


def problem(folder: Path = FOLDER) -> str:
    """Return why shared memory cannot be used; empty if it can."""
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


def remove_orphans(folder: Path = FOLDER, *, waits: bool = False) -> int:
    """Remove the files of processes that have ended and return how many; those in use stay, whoever uses them.

    New files stay as well, unless it `waits` until they are no longer new.
    """
    removed = [_remove_if_orphan(path) for path in folder.glob("*.zenoh")]
    if waits and None in removed:
        time.sleep(YOUNG)
        return removed.count(True) + remove_orphans(folder)
    return removed.count(True)


def _remove_if_orphan(path: Path) -> bool | None:
    """Return whether a file was removed; None if it is too new to be tried."""
    with contextlib.suppress(OSError):  # somebody else's, in use, or gone by now
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
        try:
            if os.fstat(descriptor).st_ctime > time.time() - YOUNG:
                return None
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
            return True
        finally:
            os.close(descriptor)
    return False
