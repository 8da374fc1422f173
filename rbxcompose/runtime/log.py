"""The log file of a robot: one record per line, each written by one system call, by several processes."""

from __future__ import annotations

import os
from pathlib import Path

from rbxcompose.diagnostics.levels import Level
from rbxcompose.runtime.records import Record

NAME, PREVIOUS = "log.jsonl", "log.1.jsonl"


class LogFile:
    """Appends records to a file. A full disk costs records, never a step; what was lost is told when there is room."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        self._lost = 0
        self._is_torn = False

    def fileno(self) -> int:
        """Return its descriptor."""
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
            written = os.write(self._descriptor, line)
        except OSError:
            return False
        self._is_torn = written < len(line)
        return not self._is_torn


def _loss(time: float, number: int) -> Record:
    return Record(time, Level.WARN, "robot", f"{number} lines of the log could not be written")


def start_new(folder: Path) -> LogFile:
    """Begin a new log in `folder` and keep the previous one."""
    if (folder / NAME).exists():
        os.replace(folder / NAME, folder / PREVIOUS)
    return LogFile(folder / NAME)
