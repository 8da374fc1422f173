"""Looking at files now and then: whether they have been written since, and to their end."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

_Stamp = tuple[int, int, int] | None  # time of the last change [ns], size [B], number of the file; None: there is none


class FileWatch:
    """Tells once of each change of files. An editor may write one in place, or another one and give it the name."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._known = {path: _stamp(path) for path in paths}  # as they were when they were told last
        self._seen = self._known  # as they were at the last look

    def follow(self, paths: Iterable[Path]) -> None:
        """Watch these files from now on; what has happened to those that were watched before still counts."""
        self._known = {path: self._known[path] if path in self._known else _stamp(path) for path in paths}
        self._seen = self._known

    def look(self) -> bool:
        """Return whether files are others than they were, and have not changed since the last look."""
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
