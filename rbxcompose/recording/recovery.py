"""Recover unfinished recordings: copy all intact content into a new file, which then has its index."""

from __future__ import annotations

from typing import IO

from rbxcompose.recording.reader import RecordingReader
from rbxcompose.recording.writer import RecordingWriter


def recover(broken: IO[bytes], whole: IO[bytes]) -> int:
    """Copy every message of `broken` until it ends or becomes invalid; return their number.

    Raises:
        NotARecordingError: if `broken` is another kind of file.
    """
    reader, writer = RecordingReader(broken), RecordingWriter(whole)
    for message in reader.messages():
        writer.add(message)
    for topic in reader.topics:
        writer.declare(topic)
    for name, data in reader.attachments.items():
        writer.attach(name, data)
    writer.finish()
    return sum(writer.counts.values())
