"""Opening files of users: regular files only, so that no pipe blocks and no device is read for ever."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO


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
