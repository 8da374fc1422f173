"""The log of a robot: records, writing whole lines from several processes, reading while it is written, its story."""

from __future__ import annotations

import fcntl
import json
import os
import tempfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BufferedReader
from itertools import pairwise
from pathlib import Path
from typing import Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain


@dataclass(frozen=True, slots=True)
class Record:
    """What `source` (an instance, or `robot` for the whole) reported at robot time `time` [s].

    It holds no wall-clock time and no process id, so that a stepped run writes the same bytes each time.
    `detail` is for the log file only, such as a traceback.
    """

    time: float
    level: Level
    source: str
    text: str
    detail: str = ""

    def to_json(self) -> str:
        """Return the record as one line, without a newline."""
        fields: dict[str, object] = {
            "t": round(self.time, 6),
            "level": self.level.name,
            "source": self.source,
            "text": self.text,
        }
        if self.detail:
            fields["detail"] = self.detail
        return json.dumps(fields, ensure_ascii=False)

    @classmethod
    def from_json(cls, line: str) -> Record:
        """Read what `to_json` wrote.

        Raises:
            ValueError: if the line is torn or is no record.
        """
        fields = json.loads(line)
        try:
            return cls(
                float(fields["t"]), Level[fields["level"]], fields["source"], fields["text"], fields.get("detail", "")
            )
        except (KeyError, TypeError) as error:
            raise ValueError(f"not a log record: {line!r}") from error


class LogLine(Protocol):
    """What a log file takes: a line of JSON, and its time."""

    @property
    def time(self) -> float:
        """Return when it was [s]."""
        ...

    def to_json(self) -> str:
        """Return it as one line, without a newline."""
        ...


WriteRecord = Callable[[Record], None]


NAME, PREVIOUS = "log.jsonl", "log.1.jsonl"
LARGEST = 4_000_000  # [B] of one file
PARTS = 4  # files that are kept besides the current one


class LogFile:
    """Appends records to a file. A full disk costs records, never a step; the loss is reported when there is room."""

    def __init__(self, path: Path, *, largest: int = LARGEST) -> None:
        """Open the file; `largest` [B] is the size at which a new one is begun."""
        self._path, self._largest = path.absolute(), largest
        self._descriptor = _opened(self._path)
        self._lost = 0
        self._is_torn = False

    def fileno(self) -> int:
        """Return its descriptor, whose number stays the same."""
        return self._descriptor

    def write(self, record: LogLine) -> None:
        """Append one record."""
        if self._lost and self._append(_loss(record.time, self._lost)):
            self._lost = 0
        if not self._append(record):
            self._lost += 1

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)

    def _append(self, record: LogLine) -> bool:
        line = record.to_json().encode(errors="backslashreplace") + b"\n"
        line = b"\n" + line if self._is_torn else line
        try:
            found = os.fstat(self._descriptor)
            if found.st_size >= self._largest or not found.st_nlink:  # or somebody has removed it
                self._go_on()
            written = os.write(self._descriptor, line)
        except OSError:
            return False
        self._is_torn = written < len(line)
        return not self._is_torn

    def _go_on(self) -> None:
        """Write to the file that has the log's name now; rename it first if it is full.

        If that fails, or a suspended process has the lock, the file continues to grow.
        """
        with suppress(OSError), _closing(_opened(self._path)) as current:
            fcntl.flock(current, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(current).st_size >= self._largest and os.path.samestat(os.fstat(current), self._path.stat()):
                _set_aside(self._path)
                with _closing(_opened(self._path)) as fresh:
                    os.dup2(fresh, self._descriptor, inheritable=False)
            else:
                fcntl.flock(current, fcntl.LOCK_UN)  # a duplicate would keep holding it
                os.dup2(current, self._descriptor, inheritable=False)


def parts_of(path: Path) -> Iterator[Path]:
    """Yield the files of a log from the newest to the oldest; they need not exist."""
    yield path
    for number in range(1, PARTS + 1):
        yield path.with_name(f"{path.name}.{number}")


def start_new(folder: Path) -> LogFile:
    """Begin a new log in `folder` and keep the previous one."""
    for part, kept in zip(parts_of(folder / NAME), parts_of(folder / PREVIOUS), strict=True):
        kept.unlink(missing_ok=True)
        if part.exists():
            part.replace(kept)
    return LogFile(folder / NAME)


def write_problem(folder: Path) -> str:
    """Return why the log in a folder cannot be written, as when its disk is full; nothing if it can."""
    try:
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            file.write(b"\n")
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _set_aside(path: Path) -> None:
    parts = list(parts_of(path))
    for younger, older in reversed(list(pairwise(parts))):
        if younger.exists():
            younger.replace(older)


@contextmanager
def _closing(descriptor: int) -> Iterator[int]:
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _opened(path: Path) -> int:
    return os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)


def _loss(time: float, number: int) -> Record:
    return Record(time, Level.WARN, "robot", f"{number} lines of the log could not be written")


class Follower:
    """Reads the records of a log as they arrive, older files first; torn and foreign lines are left out."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._files: list[_Part] = []  # oldest first; the last one is being written

    def read(self) -> list[Record]:
        """Return the records that have come since the last call."""
        self._files += self._new_files()
        records = [record for file in self._files for record in file.read()]
        for file in self._files[
            :-2
        ]:  # a file that was just renamed may still get the line of a process that was about to write
            file.close()
        self._files = self._files[-2:]
        return records

    def close(self) -> None:
        """Close the files; a last line that was never ended is left out, too."""
        while self._files:
            self._files.pop().close()

    def _new_files(self) -> list[_Part]:
        """Open the files that have begun since, oldest first.

        The search begins with the newest: one that is renamed meanwhile is found again under its next name.
        """
        found: list[_Part] = []
        for path in parts_of(self._path):
            try:
                part = _Part(path)
            except FileNotFoundError:
                if path == self._path:
                    continue  # it is just being renamed
                break
            if any(part.is_same(other) for other in found):
                part.close()
            elif any(part.is_same(file) for file in self._files):
                part.close()
                break
            else:
                found.append(part)
        return found[::-1]


class _Part:
    """One file of a log."""

    def __init__(self, path: Path) -> None:
        self._file: BufferedReader = path.open("rb")
        self._identity = os.fstat(self._file.fileno())
        self._rest = b""

    def is_same(self, other: _Part) -> bool:
        return os.path.samestat(self._identity, other._identity)

    def read(self) -> list[Record]:
        *lines, self._rest = (self._rest + self._file.read()).split(b"\n")
        records: list[Record] = []
        for line in lines:
            with suppress(ValueError):
                records.append(Record.from_json(line.decode()))
        return records

    def close(self) -> None:
        self._file.close()


_LONGEST = 2000  # maximum characters shown of a record's text
_RESET, _FAINT = "\x1b[0m", "\x1b[2m"
_LEVELS = {Level.WARN: "\x1b[33m", Level.ERROR: "\x1b[1;31m", Level.STALE: "\x1b[35m"}
_SOURCES = ("\x1b[36m", "\x1b[32m", "\x1b[34m", "\x1b[96m", "\x1b[92m", "\x1b[94m")


class StoryWriter:
    """Writes records as lines; the source column is as wide as the longest name that will come."""

    def __init__(self, sources: Iterable[str], *, colour: bool) -> None:
        self._width = max((len(name) for name in (*sources, "robot")), default=0)
        self._colour = colour

    def line(self, record: Record) -> str:
        """Return one record, without a newline: `   22.55  mission  go_to corner_1`."""
        source = f"{plain(record.source):<{self._width}}"
        text = plain(record.text, _LONGEST)
        if record.level is not Level.OK:
            text = f"{record.level.name.lower()}: {text}"
        if self._colour:
            # The same source has the same colour in every run.
            paint = _SOURCES[zlib.crc32(record.source.encode(errors="replace")) % len(_SOURCES)]
            source = f"{paint}{source}{_RESET}"
            text = f"{_LEVELS[record.level]}{text}{_RESET}" if record.level in _LEVELS else text
            return f"{_FAINT}{record.time:8.2f}{_RESET}  {source}  {text}"
        return f"{record.time:8.2f}  {source}  {text}"


def summary(robot: str, reason: str, time: float, facts: Mapping[str, Mapping[str, str]]) -> str:
    """Return how the run of `robot` ended: the reason, robot time [s], and facts by instance and label, aligned."""
    labels = Counter(label for some in facts.values() for label in some)
    lines = [("robot time", f"{time:.2f} s")]
    for instance in sorted(facts):
        for label, text in facts[instance].items():
            lines.append((label if labels[label] == 1 else f"{instance} {label}", text))
    width = max(len(label) for label, _ in lines)
    rows = [f"  {plain(label):<{width}}  {plain(text)}" for label, text in lines]
    return "\n".join([f"{robot} is down: {plain(reason)}", *rows])
