"""One recorded message."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.recording.topics import RecordedTopic


@dataclass(frozen=True, slots=True)
class Recorded:
    """A message as bytes, with the times [ns since 1970] when it arrived and when it was published."""

    topic: RecordedTopic
    log_time: int
    publish_time: int
    sequence: int  # counted by its publisher; 0 if not counted
    payload: bytes
