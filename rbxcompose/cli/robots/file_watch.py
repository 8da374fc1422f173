"""Polling of files: whether they have changed, and whether their writing is complete."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

_Stamp = tuple[int, int, int] | None  # time of the last change [ns], size [B], inode; None: no such file


class FileWatch:
    """Reports each change of files once. An editor may write a file in place, or replace it by another."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._known = {path: _stamp(path) for path in paths}  # as they were at the last report
        self._seen = self._known  # as they were at the last call of `look`

    def follow(self, paths: Iterable[Path]) -> None:
        """Watch these files from now on; earlier changes to files that were watched before still count."""
        self._known = {path: self._known[path] if path in self._known else _stamp(path) for path in paths}
        self._seen = self._known

    def look(self) -> bool:
        """Return whether files have changed, but not since the last call."""
        now = {path: _stamp(path) for path in self._known}
        is_settled, self._seen = now == self._seen, now
        if now == self._known or not is_settled:
            return False
        self._known = now
        return True


def _stamp(path: Path) -> _Stamp:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_ctime_ns, found.st_size, found.st_ino
