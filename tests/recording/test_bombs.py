"""Recordings that unpack to far more than their size explains."""

from __future__ import annotations

import io
import tracemalloc
import zlib

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Chunk, Message, Schema

from rbxcompose.runtime.recording import reader
from rbxcompose.runtime.recording.files import RecordingWriter
from rbxcompose.runtime.recording.reader import RecordingReader
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic

HEAD = b"\x89MCAP0\r\n"
CHANNEL_ID = 1


def _end(made: RecordBuilder) -> bytes:
    data: bytes = made.end()  # type: ignore[no-untyped-call]
    return data


def message(size: int) -> bytes:
    made = RecordBuilder()
    Message(CHANNEL_ID, log_time=1, data=bytes(size), publish_time=1, sequence=0).write(made)
    return _end(made)


def channel(ids: range = range(CHANNEL_ID, CHANNEL_ID + 1), definition: bytes = b"string data") -> bytes:
    made = RecordBuilder()
    Schema(id=1, data=definition, encoding="ros2msg", name="std_msgs/msg/String").write(made)
    for number in ids:
        Channel(id=number, topic=f"/topic_{number}", message_encoding="cdr", metadata={}, schema_id=1).write(made)
    return _end(made)


def chunk(content: bytes, crc: int | None = None) -> bytes:
    packed = zstandard.ZstdCompressor().compress(content)
    made = RecordBuilder()
    crc = zlib.crc32(content) if crc is None else crc
    Chunk(
        "zstd", packed, message_end_time=1, message_start_time=1, uncompressed_crc=crc, uncompressed_size=len(content)
    ).write(made)
    return _end(made)


def read(data: bytes) -> tuple[int, str]:
    recording_reader = RecordingReader(io.BytesIO(data))
    return sum(1 for _ in recording_reader.messages()), recording_reader.damage


def test_records_of_a_chunk_take_no_more_memory_than_the_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    content = message(0) * 5_000
    data = HEAD + channel() + chunk(content)
    read(data)
    tracemalloc.start()
    assert read(data)[0] == 5_000
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3 * len(content)


def test_channels_share_the_definition_of_their_type() -> None:
    recording_reader = RecordingReader(io.BytesIO(HEAD + channel(range(1, 1000), b"#" * 100_000)))
    assert not list(recording_reader.messages())
    assert len(recording_reader.topics) == 999
    assert len({id(topic.definition) for topic in recording_reader.topics}) == 1


def test_more_messages_than_a_recording_of_this_size_has_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "_MOST_MESSAGES", 1000)
    data = HEAD + channel() + chunk(message(0) * 50_000)
    count, damage = read(data)
    assert count == 1000 + len(data)
    assert "it holds more messages than a recording would" in damage


def test_more_records_of_unknown_kinds_than_a_recording_of_this_size_has_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(reader, "_MOST_MESSAGES", 1000)
    unknown = b"\x7f" + bytes(8)
    few = HEAD + channel() + chunk(unknown * 900 + message(0))
    assert read(few)[0] == 1
    count, damage = read(few + chunk(unknown * 50_000 + message(0)))
    assert count == 1
    assert "it holds more records than a recording would" in damage


def test_chunks_within_chunks_are_not_unpacked() -> None:
    count, damage = read(HEAD + channel() + chunk(message(0) + chunk(message(0) * 1000)) + message(0))
    assert (count, damage) == (1, "a part makes no sense (a chunk holds another one)")


def test_chunks_that_unpack_to_more_than_a_recording_of_this_size_has_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(reader, "LARGEST", 1_000_000)
    monkeypatch.setattr(reader, "_MOST_PACKED", 1000)
    data = HEAD + channel() + 20 * chunk(message(900_000))
    count, damage = read(data)
    assert 1 <= count < 5
    assert "it unpacks to more than a recording would" in damage


def test_pictures_that_are_black_all_over_are_a_recording() -> None:
    file, topic = io.BytesIO(), RecordedTopic("/image", "sensor_msgs/msg/Image", "RIHS01_00")
    writer = RecordingWriter(file)
    for time in range(40):
        writer.add(Recorded(topic, time, time, time, bytes(1920 * 1080 * 3)))
    writer.finish()
    assert read(file.getvalue()) == (40, "")


def test_a_chunk_above_the_limit_is_refused_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "LARGEST", 1_000_000)
    count, damage = read(HEAD + channel() + chunk(message(1_100_000)))
    assert (count, damage) == (0, "a part makes no sense (a chunk is too large)")


def test_a_chunk_with_a_wrong_checksum_gives_nothing() -> None:
    count, damage = read(HEAD + channel() + chunk(message(10), crc=7) + chunk(message(10)))
    assert (count, damage) == (0, "a part makes no sense (the checksum of a chunk is wrong)")
