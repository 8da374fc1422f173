"""Write recordings: MCAP with CDR payloads, in small chunks that are closed often, so that crashes lose little."""

from __future__ import annotations

from collections import Counter
from typing import IO

from mcap.writer import CompressionType, Writer

import rbxcompose
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.topics import RecordedTopic

PROFILE = "ros2"
SCHEMA = "ros2msg"
CHUNK = 256 * 1024  # bytes
_MASK = 0xFFFF_FFFF  # a sequence number of MCAP has 32 bits


class RecordingWriter:
    """Writes one file. File errors are raised as `OSError`."""

    def __init__(self, file: IO[bytes]) -> None:
        self.counts: Counter[RecordedTopic] = Counter()
        self._file = file
        self._channels: dict[RecordedTopic, int] = {}
        self._schemas: dict[tuple[str, str], int] = {}
        self._writer = Writer(file, chunk_size=CHUNK, compression=CompressionType.ZSTD)
        self._writer.start(PROFILE, f"rbxcompose {rbxcompose.__version__}")

    @property
    def size(self) -> int:
        """Return how many bytes were written, without those of the open chunk."""
        return self._file.tell()

    def attach(self, name: str, data: bytes) -> None:
        """Attach a JSON file, which readers find by its name."""
        self._writer.add_attachment(0, 0, name, "application/json", data)

    def declare(self, topic: RecordedTopic) -> None:
        """Declare a topic, even if it will have no messages."""
        if topic not in self._channels:
            self._channels[topic] = self._register(topic)

    def add(self, message: Recorded) -> None:
        """Add a message to the open chunk."""
        topic = message.topic
        self.declare(topic)
        self._writer.add_message(
            self._channels[topic],
            message.log_time,
            message.payload,
            message.publish_time,
            message.sequence & _MASK,
        )
        self.counts[topic] += 1

    def flush(self) -> None:
        """Close the open chunk and pass everything to the operating system."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index; afterwards nothing can be added."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.flush()

    def _register(self, topic: RecordedTopic) -> int:
        key = (topic.type, topic.definition)
        if key not in self._schemas:
            encoding = SCHEMA if topic.definition else ""
            self._schemas[key] = self._writer.register_schema(topic.type, encoding, topic.definition.encode())
        return self._writer.register_channel(topic.name, topic.encoding, self._schemas[key], topic.metadata())
