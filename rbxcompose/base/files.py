"""Files of users: opened only if they are regular, replaced completely or not at all."""

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

TEMPORARY = ".new"  # marks a file that has not replaced its target yet


def replace_file(path: Path, data: bytes, *, mode: int | None = None) -> None:
    """Create or replace a file. An existing file keeps its mode; a new one gets `mode`, or the default for new files.

    Raises:
        OSError: if it cannot be written; the old file is then unchanged.
    """
    import tempfile  # with compression and random numbers, which no check needs

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


def state_folder() -> Path:
    """Return the folder where programs of this user keep what outlasts a robot's run; it may not exist yet."""
    return Path(os.environ.get("XDG_STATE_HOME") or Path("~/.local/state").expanduser()) / "rbxcompose"


def sync_folder(folder: Path) -> None:
    """Flush a folder to disk, so that its entries survive a power failure."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other process is within this context of a folder.

    Raises:
        OSError: if there is no such folder.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
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


class NotRegularError(OSError):
    """Raised when a path does not lead to a regular file, but to a pipe, a device or a folder."""


class TooLargeError(OSError):
    """Raised when a file exceeds the size limit of its kind."""


def open_regular(path: Path, *, follow: bool = True) -> BinaryIO:
    """Open a user's file for reading; with `follow=False` the path must not end in a link.

    Raises:
        NotRegularError: if it is not a regular file.
        OSError: if it does not exist or cannot be read.
    """
    # O_NONBLOCK: opening a pipe without a writer would block before we know what it is.
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | (0 if follow else os.O_NOFOLLOW)
    descriptor = os.open(path, flags)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise NotRegularError(0, "it is not a regular file")
        return open(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_regular(path: Path, most: int) -> bytes:
    """Return the contents of a user's file.

    Raises:
        TooLargeError: if it is larger than `most` [B].
        NotRegularError: if it is not a regular file.
        OSError: if it does not exist or cannot be read.
    """
    with open_regular(path) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise TooLargeError(0, f"it is larger than {most:,} bytes")
    return data
