"""The log of missions in memory: the newest records as they are, older ones compressed, the oldest dropped."""

from __future__ import annotations

import json
import zlib
from collections import deque
from collections.abc import Iterator

from rbxcompose.missions.engine.logbook import LogRecord

BLOCK = 200  # records that are packed together, into about a tenth of their memory
MOST_BLOCKS = 100


class LogStore:
    """Keeps the last `MOST_BLOCKS` blocks of records, so that a long patrol takes no more memory than a short one."""

    def __init__(self) -> None:
        self.written = 0  # records so far
        self._packed: deque[bytes] = deque(maxlen=MOST_BLOCKS)
        self._new: list[LogRecord] = []

    def append(self, record: LogRecord) -> None:
        """Add a record, which is data for JSON."""
        self.written += 1
        self._new.append(record)
        if len(self._new) == BLOCK:
            self._packed.append(zlib.compress(json.dumps(self._new).encode()))
            self._new = []

    def since(self, number: int) -> list[LogRecord]:
        """Return the records after the first `number`, as far as they are kept."""
        first = self.written - len(self._new) - BLOCK * len(self._packed)
        return [one for at, one in enumerate(self._all(max(0, number - first) // BLOCK), first) if at >= number]

    def _all(self, skipped: int) -> Iterator[LogRecord]:
        """Yield all records; the first `skipped` blocks are not decompressed, and yield empty ones."""
        for at, block in enumerate(self._packed):
            yield from ({} for _ in range(BLOCK)) if at < skipped else json.loads(zlib.decompress(block))
        yield from self._new
