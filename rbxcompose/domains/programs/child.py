"""One program of others as its component sees it: started, heard, stopped."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rbxcompose.base.dataclass import dataclass

KEEPER = Path(__file__).with_name("keeper.py")
MOST_READ = 256 * 1024  # [bytes] at once; a program that writes more waits
LONGEST_LINE = 2_000  # [bytes]
_KILLED = 2.0  # [s] for the keeper to end all


@dataclass(frozen=True, slots=True)
class Order:
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


@dataclass(frozen=True, slots=True)
class Line:
    """A line that it wrote, to which of its outputs does not matter."""

    text: str


@dataclass(frozen=True, slots=True)
class Started:
    """It runs."""

    pid: int


@dataclass(frozen=True, slots=True)
class NotStarted:
    """It could not be started."""

    why: str


@dataclass(frozen=True, slots=True)
class Deaf:
    """It did not end within its time after the signal, and was killed."""


@dataclass(frozen=True, slots=True)
class ProgramEnd:
    """It ended; its wait status."""

    status: int


@dataclass(frozen=True, slots=True)
class LeftBehind:
    """It had left so many processes in the background, which were killed."""

    number: int


Event = Line | Started | NotStarted | Deaf | ProgramEnd | LeftBehind


class Child:
    """A program and its keeper; nothing here waits but `close`."""

    def __init__(self, order: Order) -> None:
        """Start it.

        Raises:
            OSError: if no process can be started.
        """
        self._reports, report = os.pipe()
        self._lines, output = os.pipe()
        wanted = {name: getattr(order, name) for name in order.__slots__}
        wanted |= {"environment": dict(order.environment), "report": report}
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
        finally:
            os.close(report)
            os.close(output)
        self._write(json.dumps(wanted).encode() + b"\n")
        for descriptor in (self._reports, self._lines):
            os.set_blocking(descriptor, False)
        self._heard = {self._reports: b"", self._lines: b""}
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
            yield Line(line.decode("utf-8", "replace"))
        for report in reports:
            yield self._event(json.loads(report))

    def wait(self, seconds: float) -> None:
        """Wait until there is something to hear, at most so long [s]."""
        select.select([*self._heard], [], [], seconds)

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
            self._keeper.wait(_KILLED)
        except subprocess.TimeoutExpired:
            self._keeper.kill()
            self._keeper.wait()
        for descriptor in self._heard:
            os.close(descriptor)
        self._heard = {}

    def _write(self, data: bytes) -> None:
        try:
            if self._keeper.stdin is not None:
                self._keeper.stdin.write(data)
        except BrokenPipeError:
            return  # it is over

    def _event(self, report: Mapping[str, object]) -> Event:
        match report:
            case {"event": "started", "pid": int(pid)}:
                self.pid = pid
                return Started(pid)
            case {"event": "failed", "why": [why, what]}:
                return NotStarted(f"{what}: {why}" if what else str(why))
            case {"event": "ended", "status": int(status)}:
                self.pid = None
                return ProgramEnd(status)
            case {"event": "left", "number": int(number)}:
                return LeftBehind(number)
            case _:
                return Deaf()

    def _read(self, descriptor: int, *, is_over: bool) -> Iterator[bytes]:
        """Yield the whole lines that have come; the rest stays until it is whole, too long or the last one."""
        if descriptor not in self._heard:
            return
        left, size = self._heard[descriptor], 0
        while size < MOST_READ:
            try:
                data = os.read(descriptor, 65536)
            except BlockingIOError:
                break
            if not data:
                break
            size += len(data)
            *lines, left = (left + data).split(b"\n")
            yield from lines
            if len(left) > LONGEST_LINE:
                yield left
                left = b""
        if is_over and left:
            yield left
            left = b""
        self._heard[descriptor] = left


def memory_of(pid: int) -> int:
    """Return what a process and all that it started hold in memory [bytes]; shared pages count for each."""
    total = 0
    left = [pid]
    while left:
        process = left.pop()
        try:
            pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
            for task in os.listdir(f"/proc/{process}/task"):
                children = Path(f"/proc/{process}/task/{task}/children").read_text(encoding="ascii")
                left += [int(text) for text in children.split()]
        except (OSError, IndexError):
            continue  # it has just ended
        total += pages * os.sysconf("SC_PAGE_SIZE")
    return total
