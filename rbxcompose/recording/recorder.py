"""A recording in progress: chunks close twice a second, and a full file begins a new one. Time [s] is an argument."""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from pathlib import Path
from typing import IO

from rbxcompose.dataclass import dataclass
from rbxcompose.recording.files import complete, create
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.topics import RecordedTopic
from rbxcompose.recording.writer import RecordingWriter

FLUSH, SYNC = 0.5, 5.0  # [s] maximum loss of a killed recorder, and after a power failure


@dataclass(frozen=True, slots=True)
class Split:
    """When to begin a new file: after so many bytes or seconds; 0 means never."""

    size: int = 0
    time: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.size or self.time)


class Recorder:
    """Writes messages to `path`, or to `NAME_0.mcap`, `NAME_1.mcap`... if it is split.

    All methods raise `OSError` if a file cannot be created or written.
    """

    def __init__(self, path: Path, now: float, split: Split | None = None) -> None:
        self.counts: Counter[RecordedTopic] = Counter()
        self.paths: list[Path] = []
        self._wanted, self._split = path, split or Split()
        self._opened = self._flushed = self._synced = now
        self._open(now)

    def add(self, message: Recorded) -> None:
        """Record a message."""
        self._writer.add(message)
        self.counts[message.topic] += 1

    def attach(self, name: str, data: bytes) -> None:
        """Add a file to the present recording."""
        self._writer.attach(name, data)

    def declare(self, topic: RecordedTopic) -> None:
        """Declare a topic, even if it will have no messages."""
        self._writer.declare(topic)

    def keep(self, now: float) -> None:
        """Do what is due; call it several times a second."""
        if now - self._flushed >= FLUSH:
            self._writer.flush()
            self._flushed = now
        if now - self._synced >= SYNC:
            os.fsync(self._file.fileno())
            self._synced = now
        is_long = 0 < self._split.time <= now - self._opened
        if self._writer.counts and (is_long or 0 < self._split.size <= self._writer.size):
            self.finish()
            self._open(now)

    def finish(self) -> None:
        """Finish the file, which then gets its index and its name."""
        self._writer.finish()
        complete(self.paths[-1], self._file)

    def abandon(self) -> None:
        """Leave the file as it is; its contents are recovered later."""
        with contextlib.suppress(OSError):  # closing retries the write that has failed
            self._file.close()

    def _open(self, now: float) -> None:
        path = self._wanted
        if self._split:
            path = path.with_name(f"{path.stem}_{len(self.paths)}{path.suffix}")
        self._file: IO[bytes] = create(path)
        self.paths.append(path)
        self._writer = RecordingWriter(self._file)
        self._opened = self._flushed = self._synced = now
