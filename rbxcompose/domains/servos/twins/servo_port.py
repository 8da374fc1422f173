"""A pseudo-terminal with fake servos behind it, at a path that stays while it is unplugged and plugged in again."""

from __future__ import annotations

import fcntl
import heapq
import itertools
import os
import select
import struct
import threading
import time
import tty
from pathlib import Path
from typing import Self

from rbxcompose.domains.servos.twins.servo_line import FakeLine

_TCGETS2 = 0x802C542A  # Linux: the settings of a terminal with its rate as a number
_TERMIOS2 = "4IB19B2I"
_CHUNK = 4096  # [B] of one read


class FakePort:
    """A thread that lends fake servos a pseudo-terminal; `path` is a link to it.

    With `has_wire_time`, replies take as long as on a real line; with `has_echo`, requests come back, too.
    """

    def __init__(self, line: FakeLine, path: Path, *, has_wire_time: bool = False, has_echo: bool = False) -> None:
        self.line, self.path = line, path
        self._has_wire_time, self._has_echo = has_wire_time, has_echo
        self._due: list[tuple[float, int, bytes]] = []  # when [s], in which order, what
        self._order = itertools.count()
        self._thread: threading.Thread | None = None
        self.replug()

    def __enter__(self) -> Self:
        """Return this port, plugged in."""
        return self

    def __exit__(self, *_: object) -> None:
        """Unplug it."""
        self.unplug()

    def replug(self) -> None:
        """Connect the servos by a new terminal at the old path."""
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        os.set_blocking(self._far, False)
        self._wake_read, self._wake_write = os.pipe()
        link = self.path.with_name(f".{self.path.name}.new")
        link.symlink_to(os.ttyname(self._near))
        link.replace(self.path)
        self._thread = threading.Thread(target=self._serve, name="fake servos", daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Take the terminal away: whoever has it open gets an error."""
        if self._thread is None:
            return
        os.write(self._wake_write, b"x")
        self._thread.join()
        self._thread = None
        self.path.unlink(missing_ok=True)
        for descriptor in (self._far, self._near, self._wake_read, self._wake_write):
            os.close(descriptor)
        self._due.clear()

    def _serve(self) -> None:
        """Answer until the wake-up call of `unplug`."""
        while True:
            patience = max(0.0, self._due[0][0] - time.monotonic()) if self._due else None
            ready, _, _ = select.select([self._far, self._wake_read], [], [], patience)
            if self._wake_read in ready:
                return
            if self._far in ready:
                self._take(os.read(self._far, _CHUNK))
            self._send()

    def _take(self, data: bytes) -> None:
        """Pass a request to the servos, and note when their replies are due."""
        now, rate = time.monotonic(), self._rate()
        replies = self.line.receive(data, rate)
        if self._has_echo:
            self._plan(now, data)
        sent = now + 10 * len(data) / rate
        for reply in replies:
            self._plan((sent + reply.after if self._has_wire_time else now) + reply.late, reply.data)

    def _plan(self, due: float, data: bytes) -> None:
        heapq.heappush(self._due, (due, next(self._order), data))

    def _send(self) -> None:
        """Write what is due; what a terminal that nobody reads has no room for is lost, as on a wire."""
        now, data = time.monotonic(), b""
        while self._due and self._due[0][0] <= now:
            data += heapq.heappop(self._due)[2]
        if data and select.select([], [self._far], [], 0)[1]:
            os.write(self._far, data)

    def _rate(self) -> int:
        """Return the rate that the other end has set [bit/s]."""
        settings = fcntl.ioctl(self._near, _TCGETS2, bytes(struct.calcsize(_TERMIOS2)))
        return int(struct.unpack(_TERMIOS2, settings)[-1])
