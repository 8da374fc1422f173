"""The log file of a robot: one record per line, each written by one system call; several processes write to it.

A file that has grown to `LARGEST` is renamed to `log.jsonl.1`, the previous `.1` to `.2`, and so on; the oldest of
`PARTS` is removed. The process that finds the file full does this, the others notice at their next line.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path

from rbxcompose.levels import Level
from rbxcompose.runtime.records import Record

NAME, PREVIOUS = "log.jsonl", "log.1.jsonl"
LARGEST = 4_000_000  # [B] of one file
PARTS = 4  # files that are kept besides the current one


class LogFile:
    """Appends records to a file. A full disk costs records, never a step; the loss is reported when there is room."""

    def __init__(self, path: Path, *, largest: int = LARGEST) -> None:
        """Open the file; `largest` [B] is the size at which a new one is begun."""
        self._path, self._largest = path.absolute(), largest
        self._descriptor = _opened(self._path)
        self._lost = 0
        self._is_torn = False

    def fileno(self) -> int:
        """Return its descriptor, whose number stays the same."""
        return self._descriptor

    def write(self, record: Record) -> None:
        """Append one record."""
        if self._lost and self._append(_loss(record.time, self._lost)):
            self._lost = 0
        if not self._append(record):
            self._lost += 1

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)

    def _append(self, record: Record) -> bool:
        line = record.to_json().encode(errors="backslashreplace") + b"\n"
        line = b"\n" + line if self._is_torn else line
        try:
            found = os.fstat(self._descriptor)
            if found.st_size >= self._largest or not found.st_nlink:  # or somebody has removed it
                self._go_on()
            written = os.write(self._descriptor, line)
        except OSError:
            return False
        self._is_torn = written < len(line)
        return not self._is_torn

    def _go_on(self) -> None:
        """Write to the file that has the log's name now; rename it first if it is full.

        If that fails, or a suspended process has the lock, the file continues to grow.
        """
        with suppress(OSError), _closing(_opened(self._path)) as current:
            fcntl.flock(current, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(current).st_size >= self._largest and os.path.samestat(os.fstat(current), self._path.stat()):
                _set_aside(self._path)
                with _closing(_opened(self._path)) as fresh:
                    os.dup2(fresh, self._descriptor, inheritable=False)
            else:
                fcntl.flock(current, fcntl.LOCK_UN)  # a duplicate would keep holding it
                os.dup2(current, self._descriptor, inheritable=False)


def parts_of(path: Path) -> Iterator[Path]:
    """Yield the files of a log from the newest to the oldest; they need not exist."""
    yield path
    for number in range(1, PARTS + 1):
        yield path.with_name(f"{path.name}.{number}")


def start_new(folder: Path) -> LogFile:
    """Begin a new log in `folder` and keep the previous one."""
    for part, kept in zip(parts_of(folder / NAME), parts_of(folder / PREVIOUS), strict=True):
        kept.unlink(missing_ok=True)
        if part.exists():
            part.replace(kept)
    return LogFile(folder / NAME)


def _set_aside(path: Path) -> None:
    parts = list(parts_of(path))
    for younger, older in reversed(list(pairwise(parts))):
        if younger.exists():
            younger.replace(older)


@contextmanager
def _closing(descriptor: int) -> Iterator[int]:
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _opened(path: Path) -> int:
    return os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)


def _loss(time: float, number: int) -> Record:
    return Record(time, Level.WARN, "robot", f"{number} lines of the log could not be written")
