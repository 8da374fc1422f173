"""One program of others as its component sees it: started, heard, stopped; and what it writes, as lines of the log."""

from __future__ import annotations

import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from uuid import uuid4

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain

KEEPER = Path(__file__).with_name("keeper.py")
MOST_READ = 256 * 1024  # [bytes] at once; a program that writes more waits
LONGEST_LINE = 2_000  # [bytes]
_KILLED = 3.5  # [s] for the keeper to end all
_CLEANS_UP = 5.0  # [s] for what ends something elsewhere
_LOOKS = 3  # in a row that find nothing: a process that is just starting another program has no environment
_PAUSE = 0.005  # [s] between two looks for what is left
_MARK = "RBXCOMPOSE_RUN"  # in the environment of all that belongs to one run of a program
Event = tuple[str, Any]
"""What happened, with a value: `line` (its text; to which output it was written does not matter), `started` (the
process), `failed` (why it could not be started), `deaf` (it did not end within its time after the signal, and was
killed), `ended` (the wait status), `left` (how many processes it had left in the background, which were killed)."""
LONGEST = 500  # characters of a line in the log
AT_ONCE, PER_SECOND = 200, 20  # lines that are logged at once, and for a long time
TELLS = 10.0  # [s] between two records of how many were left out
_COLOURS = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
_USUAL = {Level.ERROR: r"\b(ERROR|FATAL|CRITICAL|Error|Traceback)\b", Level.WARN: r"\b(WARN|WARNING|Warning)\b"}
"""How loggers mark their lines: those of ROS 2, Python, and most others."""


@dataclass(frozen=True, slots=True)
class StartOrder:
    """What to start, and how to end it."""

    command: Sequence[str]
    folder: str
    environment: Mapping[str, str]
    signal: int
    patience: float
    """[s] after the signal, after which it is killed."""
    open_files: int | None = None
    nice: int = 0
    cores: Sequence[int] = ()
    descriptors: Sequence[int] = ()
    """Open files that it inherits."""
    cleanup: Sequence[str] = ()
    """Run when it has ended, also if nobody is left: it ends what runs elsewhere on its behalf."""


class Child:
    """A program and its keeper; nothing here waits but `close`."""

    def __init__(self, order: StartOrder) -> None:
        """Start it.

        Raises:
            OSError: if no process can be started.
        """
        self._mark = uuid4().hex
        self._reports, report = os.pipe()
        self._lines, output = os.pipe()
        wanted = {name: getattr(order, name) for name in order.__slots__}
        wanted |= {"environment": {**order.environment, _MARK: self._mark}, "report": report}
        try:
            self._keeper = subprocess.Popen(
                [sys.executable, "-I", "-S", str(KEEPER)],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=output,
                pass_fds=(report, *order.descriptors),
                start_new_session=True,
                bufsize=0,
            )
        except BaseException:
            os.close(self._reports)
            os.close(self._lines)
            raise
        finally:
            os.close(report)
            os.close(output)
        self._write(json.dumps(wanted).encode() + b"\n")
        for descriptor in (self._reports, self._lines):
            os.set_blocking(descriptor, False)
        self._heard = {self._reports: b"", self._lines: b""}
        self._silent: set[int] = set()  # nobody can write there any more
        self._patience = _KILLED + (_CLEANS_UP if order.cleanup else 0.0)
        self._is_asked = False
        self.pid: int | None = None

    @property
    def is_over(self) -> bool:
        """Return whether it has ended, with all that it had left behind."""
        return self._keeper.poll() is not None

    def events(self) -> Iterator[Event]:
        """Yield what has happened since the last look: first its lines, so that they precede its end."""
        is_over = self.is_over  # before reading, else the last lines may come after the look
        reports = list(self._read(self._reports, is_over=is_over))  # before its lines, which then include the last ones
        for line in self._read(self._lines, is_over=is_over):
            yield "line", line.decode("utf-8", "replace")
        for what, value in map(json.loads, reports):
            if what in ("started", "ended"):
                self.pid = value if what == "started" else None
            yield what, value

    def wait(self, seconds: float) -> None:
        """Wait until there is something to hear, at most so long [s]."""
        select.select(self._heard.keys() - self._silent, [], [], seconds)

    @property
    def memory(self) -> int:
        """Return what it and all that it started hold in memory [bytes]; shared pages count for each process."""
        return sum(map(_memory_of, _children_of(self._keeper.pid)))

    def ask_to_end(self) -> None:
        """Send the signal; after its time, it is killed."""
        if not self._is_asked:
            self._is_asked = True
            self._write(b"stop")

    def close(self) -> None:
        """End it with all that belongs to it, by force if need be."""
        if self._keeper.stdin is not None:
            self._keeper.stdin.close()
        try:
            self._keeper.wait(self._patience)
        except subprocess.TimeoutExpired:
            self._keeper.kill()
            self._keeper.wait()
        if self._keeper.returncode:  # it was killed, so that nobody has ended what the program had started
            _kill_marked(f"{_MARK}={self._mark}".encode())
        for descriptor in self._heard:
            os.close(descriptor)
        self._heard = {}

    def _write(self, data: bytes) -> None:
        try:
            if self._keeper.stdin is not None:
                self._keeper.stdin.write(data)
        except BrokenPipeError:
            return  # it is over

    def _read(self, descriptor: int, *, is_over: bool) -> Iterator[bytes]:
        """Yield the lines that have come, without what is too long of them; the last one only once it is whole."""
        if descriptor not in self._heard:
            return
        left, size = self._heard[descriptor], 0
        while size < MOST_READ:
            try:
                data = os.read(descriptor, 65536)
            except BlockingIOError:
                break
            if not data:
                self._silent.add(descriptor)
                break
            size += len(data)
            *lines, left = (left + data).split(b"\n")
            for line in lines:
                yield line[:LONGEST_LINE]
            left = left[:LONGEST_LINE]
        if is_over and left:
            yield left
            left = b""
        self._heard[descriptor] = left


def _kill_marked(mark: bytes) -> None:
    """Kill all processes whose environment has this; they may start others meanwhile."""
    looks, deadline = 0, time.monotonic() + _KILLED
    while looks < _LOOKS and time.monotonic() < deadline:  # some may have become somebody else's
        found = [pid for pid in map(int, filter(str.isdecimal, os.listdir("/proc"))) if _has(pid, mark)]
        looks = 0 if found else looks + 1
        for pid in found:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(_PAUSE)


def _has(pid: int, mark: bytes) -> bool:
    try:
        return mark in Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:
        return False  # it has ended, or is somebody else's


def _memory_of(pid: int) -> int:
    """Return what a process and all that it started hold in memory [bytes]; shared pages count for each."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError):
        return 0  # it has just ended
    return pages * os.sysconf("SC_PAGE_SIZE") + sum(map(_memory_of, _children_of(pid)))


def _children_of(pid: int) -> list[int]:
    with suppress(OSError):
        tasks = os.listdir(f"/proc/{pid}/task")
        files = [Path(f"/proc/{pid}/task/{task}/children") for task in tasks]
        return [int(text) for file in files for text in file.read_text(encoding="ascii").split()]
    return []


class OutputLog:
    """Turns lines into records; a program that floods its output loses the rest, which is counted."""

    def __init__(self, patterns: Mapping[Level, str]) -> None:
        """Take regular expressions by level, instead of the usual marks; ERROR counts before WARN."""
        given = {**_USUAL, **patterns}
        self._patterns = [(level, re.compile(given[level])) for level in (Level.ERROR, Level.WARN)]
        self._credit, self._since = float(AT_ONCE), 0.0
        self._left_out, self._told = 0, -TELLS

    def take(self, lines: Iterable[str], now: float) -> Iterator[tuple[Level, str]]:
        """Yield the records of lines that came at `now` [s]; infinite at its end, so that nothing is left untold."""
        self._credit = min(float(AT_ONCE), self._credit + (now - self._since) * PER_SECOND)
        self._since = now
        for line in lines:
            text = _COLOURS.sub("", line).rstrip()
            if not text:
                continue
            if self._credit < 1.0:
                self._left_out += 1
                continue
            self._credit -= 1.0
            yield self._level(text), plain(text, LONGEST)
        if self._left_out and now - self._told >= TELLS:
            number, self._left_out, self._told = self._left_out, 0, now
            lines_were = "one line was" if number == 1 else f"{number} lines were"
            yield Level.WARN, f"{lines_were} left out: it writes too many"

    def _level(self, text: str) -> Level:
        return next((level for level, pattern in self._patterns if pattern.search(text)), Level.OK)
