"""Reading recordings, even damaged or untrusted ones: intact content, summary, schedule of a replay."""

import io
import struct
import zlib
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import field
from typing import IO

import lz4.frame
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader

from rbxcompose.base.clock import NANOSECONDS
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.printable import plain
from rbxcompose.msgs.definitions import DefinitionError
from rbxcompose.msgs.registry import full_name
from rbxcompose.runtime.recording.topics import CDR, HASH, NODE, Recorded, RecordedTopic, hash_of, qos_of_metadata
from rbxcompose.sdk.ports import Qos

LARGEST = 64 * 1024 * 1024  # bytes of a record, and of an unpacked chunk
# No recording compresses better than this: large pictures that are black all over come near. A file that does was made
# to take time.
_MOST_PACKED = 20_000  # unpacked bytes per byte of the file, beyond `LARGEST`
_MOST_MESSAGES = 100_000  # beyond one per byte of the file: each differs from the one before in its time at least
_RECORD = struct.Struct("<BQ")  # what a record begins with: its kind and its length
_MAGIC = b"\x89MCAP0\r\n"

# Besides their own errors, the readers of MCAP and of its compressions raise these for invalid bytes.
_BROKEN = (McapError, ValueError, struct.error, OverflowError, RuntimeError, EOFError, zstandard.ZstdError)


class _BombError(ValueError):
    """Raised for content that would take more memory or time than its size explains."""


class NotARecordingError(ValueError):
    """Raised when a file does not begin as MCAP does."""


class RecordingReader:
    """Reads one file once, from its beginning. Afterwards, `damage` says why it ended early, if it did."""

    @property
    def topics(self) -> Collection[RecordedTopic]:
        """Return the topics in the part read so far, including those without messages."""
        return self._channels.values()

    def __init__(self, file: IO[bytes]) -> None:
        """Check the first bytes.

        Raises:
            NotARecordingError: if it is another kind of file.
        """
        head = file.read(len(_MAGIC))
        if not _MAGIC.startswith(head):
            raise NotARecordingError("it does not start like an MCAP file")
        file.seek(0)
        self.damage = ""
        self.attachments: dict[str, bytes] = {}  # by name, in the part read so far
        self._file = file
        self._reader = StreamReader(file, emit_chunks=True, record_size_limit=LARGEST)
        self._schemas: dict[int, tuple[str, str]] = {}  # name and definition
        self._hashes: dict[tuple[str, str], str] = {}  # by those
        self._channels: dict[int, RecordedTopic] = {}
        self._unpacked = 0  # [bytes] so far
        self._count = 0  # of messages so far, and of other records in chunks

    def messages(self) -> Iterator[Recorded]:
        """Yield the messages in the order of the file, until it ends or becomes invalid."""
        try:
            yield from self._messages_of(self._records())
        except _BROKEN as error:
            # A truncated file gives many kinds of error: numbers that are too short, chunks that do not unpack.
            is_cut = not isinstance(error, _BombError) and not self._file.read(1)
            self.damage = "it ends in the middle" if is_cut else f"a part makes no sense ({plain(str(error), 100)})"

    def _records(self) -> Iterator[McapRecord]:
        """Yield the records of the file, and of its chunks instead of these."""
        for record in self._reader.records:
            if isinstance(record, Chunk):
                yield from self._records_of(record)
            else:
                yield record

    def _records_of(self, chunk: Chunk) -> Iterator[McapRecord]:
        """Yield the records of a chunk one by one: they would take several times its memory."""
        data = _unpacked(chunk)
        self._unpacked += len(data)
        if self._unpacked > LARGEST + _MOST_PACKED * self._file.tell():
            raise _BombError("it unpacks to more than a recording would")
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise ValueError("the checksum of a chunk is wrong")
        self._count_others(data)
        stream = io.BytesIO(data)
        try:
            for record in StreamReader(stream, skip_magic=True, emit_chunks=True, record_size_limit=LARGEST).records:
                if isinstance(record, Chunk):
                    raise ValueError("a chunk holds another one")
                yield record
        except EndOfFile:
            if stream.tell() < len(data):
                raise

    def _count_others(self, data: bytes) -> None:
        """Count the records of a chunk that are no messages: the reader of MCAP skips those of unknown kinds itself."""
        most, size, place = self._most(), len(data), 0
        while place + _RECORD.size <= size:
            opcode, length = _RECORD.unpack_from(data, place)
            place += _RECORD.size + length
            if opcode != Opcode.MESSAGE:
                self._count += 1
                if self._count > most:
                    raise _BombError("it holds more records than a recording would")

    def _most(self) -> int:
        """Return how many messages and other records the part of the file read so far may hold."""
        return _MOST_MESSAGES + self._file.tell()

    def _messages_of(self, records: Iterable[McapRecord]) -> Iterator[Recorded]:
        for record in records:
            if isinstance(record, Schema):
                self._schemas[record.id] = record.name, record.data.decode()
            elif isinstance(record, Channel):
                self._channels[record.id] = self._topic(record)
            elif isinstance(record, Attachment):
                self.attachments[record.name] = record.data
            elif isinstance(record, Message):
                if record.channel_id not in self._channels:
                    raise ValueError("a message of an unknown channel")
                self._count += 1
                if self._count > self._most():
                    raise _BombError("it holds more messages than a recording would")
                yield Recorded(
                    self._channels[record.channel_id],
                    record.log_time,
                    record.publish_time,
                    record.sequence,
                    record.data,
                )

    def _topic(self, channel: Channel) -> RecordedTopic:
        name, definition = self._schemas.get(channel.schema_id, ("", ""))
        hash_ = channel.metadata.get(HASH, "")
        if channel.message_encoding == CDR:
            name = full_name(name, "msg")
            hash_ = hash_ or self._hash_of(name, definition)
        return RecordedTopic(
            channel.topic,
            name,
            hash_,
            qos_of_metadata(channel.metadata),
            definition,
            channel.message_encoding,
            channel.metadata.get(NODE, ""),
        )

    def _hash_of(self, name: str, definition: str) -> str:
        """Return the hash of a type; recordings of others lack it."""
        if (name, definition) not in self._hashes:
            self._hashes[name, definition] = ""
            with suppress(DefinitionError):
                self._hashes[name, definition] = hash_of(name, definition)
        return self._hashes[name, definition]


def _unpacked(chunk: Chunk) -> bytes:
    """Return the content of a chunk, but never to more than `LARGEST` bytes, whatever size it claims."""
    if chunk.compression == "zstd":
        size = zstandard.get_frame_parameters(chunk.data).content_size
        if size != zstandard.CONTENTSIZE_UNKNOWN and size > LARGEST:
            raise _BombError("a chunk is too large")
        return zstandard.ZstdDecompressor().decompress(chunk.data, min(chunk.uncompressed_size, LARGEST))
    if chunk.compression == "lz4":
        data: bytes = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, LARGEST)
        return data
    if not chunk.compression:
        return chunk.data
    raise ValueError("a chunk has an unknown compression")


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
