"""Files of recordings: writing them in small chunks, locks, names, recovery."""

import contextlib
import fcntl
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from mcap.writer import CompressionType, Writer

import rbxcompose
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import open_regular, sync_folder
from rbxcompose.base.printable import plain
from rbxcompose.runtime.recording.reader import NotARecordingError, RecordingReader
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic

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
            self._channels[topic], message.log_time, message.payload, message.publish_time, message.sequence & _MASK
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


ENDING, PART = ".mcap", ".part"
_NEW = ".new"


@dataclass(frozen=True, slots=True)
class Recovered:
    """The outcome for an unfinished file: its new name and number of messages, or why it was left unchanged."""

    path: Path
    messages: int = 0
    problem: str = ""


def part_of(path: Path) -> Path:
    """Return the name of a file until it is finished."""
    return path.with_name(path.name + PART)


def create(path: Path) -> IO[bytes]:
    """Create the part of a new file and lock it.

    Raises:
        FileExistsError: if the file or its part already exists.
        OSError: if it cannot be created.
    """
    if path.exists():
        raise FileExistsError(f"{path} already exists")
    file = part_of(path).open("xb")
    fcntl.flock(file.fileno(), fcntl.LOCK_EX)
    return file


def write_problem(path: Path) -> str:
    """Return why `create` would fail, or nothing; to be reported before a run begins."""
    name = plain(str(path))
    if path.exists() or part_of(path).exists():
        return f"'{name}' already exists"
    if not path.parent.is_dir():
        return f"'{name}' cannot be written: there is no folder '{plain(str(path.parent))}'"
    return "" if os.access(path.parent, os.W_OK) else f"'{name}' cannot be written: its folder is read-only"


def complete(path: Path, file: IO[bytes]) -> None:
    """Give a finished file its name, so that it exists completely or not at all, even after a power failure."""
    os.fsync(file.fileno())
    os.rename(part_of(path), path)
    file.close()
    sync_folder(path.parent)


def recover_all(folder: Path) -> Iterator[Recovered]:
    """Recover the unfinished files in a folder that nobody is writing."""
    for part in sorted(folder.glob(f"*{ENDING}{PART}")):
        path = part.with_name(part.name.removesuffix(PART))
        try:
            with open_regular(part, follow=False) as file:
                if _is_ours(file, part):
                    yield Recovered(path, _recover(file, part, path))
        except (OSError, NotARecordingError) as error:
            yield Recovered(part, problem=getattr(error, "strerror", None) or str(error))


def _is_ours(file: IO[bytes], part: Path) -> bool:
    """Lock a part and return whether it is ours: not if its writer still has it, or has finished it meanwhile."""
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return part.exists() and os.path.samestat(os.fstat(file.fileno()), os.stat(part))


def _recover(file: IO[bytes], part: Path, path: Path) -> int:
    if path.exists():
        raise FileExistsError(f"{path} already exists")
    new = part.with_name(part.name + _NEW)
    new.unlink(missing_ok=True)  # left by an interrupted recovery
    with new.open("xb") as whole:
        try:
            messages = recover(file, whole)
            whole.flush()
            os.fsync(whole.fileno())
        except (OSError, NotARecordingError):  # such as on a full disk
            new.unlink()
            raise
    os.rename(new, part)  # now the part is complete, and recovering it again would change nothing
    os.rename(part, path)
    sync_folder(path.parent)
    return messages


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

    `kept` is how many messages of the present file a recovery finds at least, if it cannot be written any further.
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
            self._flushed, self.kept = now, self._writer.counts.total()
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
        self.kept = 0
