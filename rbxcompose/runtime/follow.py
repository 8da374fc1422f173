"""Reading a log that may still be written: whole lines only, and on to the next file when a new one begins."""

from __future__ import annotations

import os
from io import BufferedReader
from pathlib import Path

from rbxcompose.runtime.records import Record


class Follower:
    """Reads the records of a log file as they come. `skipped` counts lines that were torn or foreign."""

    def __init__(self, path: Path) -> None:
        self.skipped = 0
        self._path = path
        self._file: BufferedReader | None = None
        self._rest = b""

    def read(self) -> list[Record]:
        """Return the records that have come since the last call."""
        records = self._read_open()
        if self._has_moved():
            records += self._read_open()  # what came between the reading and the change of files
            self.close()
            self._file = self._path.open("rb")
            records += self._read_open()
        return records

    def close(self) -> None:
        """Close the file; a last line that was never ended counts as torn."""
        if self._file is not None:
            self._file.close()
            self._file = None
        self.skipped += bool(self._rest)
        self._rest = b""

    def _has_moved(self) -> bool:
        try:
            now = os.stat(self._path)
        except FileNotFoundError:
            return False
        return self._file is None or os.fstat(self._file.fileno()).st_ino != now.st_ino

    def _read_open(self) -> list[Record]:
        if self._file is None:
            return []
        *lines, self._rest = (self._rest + self._file.read()).split(b"\n")
        records: list[Record] = []
        for line in lines:
            try:
                records.append(Record.from_json(line.decode()))
            except ValueError:
                self.skipped += 1
        return records


def read_log(path: Path) -> list[Record]:
    """Return all records of a log file, none if it does not exist."""
    follower = Follower(path)
    try:
        return follower.read()
    finally:
        follower.close()
