"""The schedule of a replay: when each message of a recording is due, from the start of the replay [s]."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rbxcompose.clock import NANOSECONDS
from rbxcompose.qos import Qos
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.topics import RecordedTopic


def playlist(
    messages: Iterable[Recorded], *, rate: float = 1.0, start: float = 0.0
) -> Iterator[tuple[float, Recorded]]:
    """Yield each message with the time at which it is due, in the order of the recording.

    `start` [s of the recording] skips earlier messages, except for the last one of each latched topic, which is due
    immediately. A message with an earlier time than the one before it is due together with that one.
    """
    first: int | None = None
    latched: dict[RecordedTopic, Recorded] = {}
    due = 0.0
    for message in messages:
        first = message.log_time if first is None else first
        since = (message.log_time - first) / NANOSECONDS - start
        if since < 0 and due == 0:
            if message.topic.qos is Qos.LATCHED:
                latched[message.topic] = message
            continue
        for one in latched.values():
            yield 0.0, one
        latched.clear()
        due = max(due, since / rate)
        yield due, message
