"""The contents of a recording: topics, counts, and the time span."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import field

from rbxcompose.clock import NANOSECONDS
from rbxcompose.dataclass import dataclass
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.topics import RecordedTopic


@dataclass(slots=True)
class RecordingSummary:
    """The topics of a recording with the number of their messages, and its times [ns since 1970]."""

    counts: Counter[RecordedTopic] = field(default_factory=Counter)
    start: int = 0
    end: int = 0

    @property
    def duration(self) -> float:
        """Return the time [s] from the first message to the last."""
        return (self.end - self.start) / NANOSECONDS

    @property
    def messages(self) -> int:
        """Return the number of messages."""
        return sum(self.counts.values())


def summary_of(messages: Iterable[Recorded]) -> RecordingSummary:
    """Read a recording and summarise it."""
    summary = RecordingSummary()
    for message in messages:
        if not summary.counts:
            summary.start = summary.end = message.log_time
        summary.counts[message.topic] += 1
        summary.start, summary.end = min(summary.start, message.log_time), max(summary.end, message.log_time)
    return summary
