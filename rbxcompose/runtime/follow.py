"""Reads a log that may still be written: only whole lines, and on to the next file when a new one starts."""

from __future__ import annotations

import os
from io import BufferedReader
from pathlib import Path

from rbxcompose.runtime.log import parts_of
from rbxcompose.runtime.records import Record


class Follower:
    """Reads the records of a log as they arrive, older files first. `skipped` counts torn and foreign lines."""

    def __init__(self, path: Path) -> None:
        self.skipped = 0
        self._path = path
        self._files: list[_Part] = []  # oldest first; the last one is being written

    def read(self) -> list[Record]:
        """Return the records that have come since the last call."""
        self._files += self._new_files()
        records = [record for file in self._files for record in file.read()]
        for file in self._files[
            :-2
        ]:  # a file that was just renamed may still get the line of a process that was about to write
            self._close(file)
        self._files = self._files[-2:]
        self.skipped += sum(file.take_skipped() for file in self._files)
        return records

    def close(self) -> None:
        """Close the files; a last line that was never ended counts as torn."""
        while self._files:
            self._close(self._files.pop())

    def _close(self, file: _Part) -> None:
        file.close()
        self.skipped += file.take_skipped()

    def _new_files(self) -> list[_Part]:
        """Open the files that have begun since, oldest first.

        The search begins with the newest: one that is renamed meanwhile is found again under its next name.
        """
        found: list[_Part] = []
        for path in parts_of(self._path):
            try:
                part = _Part(path)
            except FileNotFoundError:
                if path == self._path:
                    continue  # it is just being renamed
                break
            if any(part.is_same(one) for one in found):
                part.close()
            elif any(part.is_same(one) for one in self._files):
                part.close()
                break
            else:
                found.append(part)
        return found[::-1]


class _Part:
    """One file of a log."""

    def __init__(self, path: Path) -> None:
        self._file: BufferedReader = path.open("rb")
        self._identity = os.fstat(self._file.fileno())
        self._rest = b""
        self._skipped = 0

    def is_same(self, other: _Part) -> bool:
        return os.path.samestat(self._identity, other._identity)

    def read(self) -> list[Record]:
        *lines, self._rest = (self._rest + self._file.read()).split(b"\n")
        records: list[Record] = []
        for line in lines:
            try:
                records.append(Record.from_json(line.decode()))
            except ValueError:
                self._skipped += 1
        return records

    def take_skipped(self) -> int:
        """Return the number of lines skipped since the last call."""
        skipped, self._skipped = self._skipped, 0
        return skipped

    def close(self) -> None:
        self._file.close()
        self._skipped += bool(self._rest)
        self._rest = b""


def read_log(path: Path) -> list[Record]:
    """Return all records of a log, none if it does not exist."""
    follower = Follower(path)
    try:
        return follower.read()
    finally:
        follower.close()
