"""The socket between the two sides of the bridge: frames of bytes. It runs in both Pythons, so it imports no package.

Nobody who sends ever waits: what the other side does not take at once is queued, and of each channel only the newest
frames are kept, as many as its depth.
"""

from __future__ import annotations

import json
import socket
import struct
import threading
from collections import deque

TYPE_CHECKING = False  # as in `typing`
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

DATA, REQUEST, RESPONSE, ERROR, EVENT = range(5)
"""Kinds of frames: a message, a request, its response or the reason why there is none, a JSON text."""
_HEADER = struct.Struct("<IHBxQ")  # size of the payload, channel, kind, number
_BUFFER = 1 << 20  # [bytes]
LARGEST = 256 << 20  # [bytes] of a frame; more is a mistake of the other side


class Frame:
    """What the other side sent; `number` tells requests apart."""

    __slots__ = ("channel", "kind", "number", "payload")

    def __init__(self, channel: int, kind: int, number: int, payload: bytes) -> None:
        self.channel, self.kind, self.number, self.payload = channel, kind, number, payload


class Link:
    """One end of the socket; any thread may send, one receives."""

    def __init__(self, end: socket.socket) -> None:
        self._socket = end
        self._queue: deque[tuple[int, bytes]] = deque()
        self._queued: dict[int, int] = {}  # frames by channel
        self._lock = threading.Lock()
        self._waits = threading.Condition(self._lock)
        self.dropped: dict[int, int] = {}
        self.is_open = True
        threading.Thread(target=self._write, name="bridge writer", daemon=True).start()

    def send(self, channel: int, kind: int, payload: bytes, number: int = 0, *, depth: int = 0) -> None:
        """Send a frame; with a `depth`, that many of the channel wait at most, and older ones are dropped."""
        header = _HEADER.pack(len(payload), channel, kind, number)
        with self._lock:
            if not self.is_open:
                return
            if not self._queue:
                sent = self._at_once(header, payload)
                if sent == len(header) + len(payload):
                    return
                self._append(-1, (header + payload)[sent:], 0) if sent else self._append(channel, header + payload, 0)
            else:
                self._append(channel, header + payload, depth)
            self._waits.notify()

    def event(self, **words: object) -> None:
        """Send a JSON text."""
        self.send(0, EVENT, json.dumps(words).encode())

    def frames(self) -> Iterator[Frame]:
        """Yield what the other side sends until it closes the socket."""
        with self._socket.makefile("rb", buffering=_BUFFER) as stream:
            while len(header := _read(stream, _HEADER.size)) == _HEADER.size:
                size, channel, kind, number = _HEADER.unpack(header)
                if size > LARGEST or len(payload := _read(stream, size)) < size:
                    break
                yield Frame(channel, kind, number, payload)
        self.close()
        self._socket.close()

    def close(self) -> None:
        """Close the socket; both sides stop receiving."""
        with self._lock:
            if not self.is_open:
                return
            self.is_open = False
            self._waits.notify()
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            return  # the other side was faster

    def _at_once(self, header: bytes, payload: bytes) -> int:
        try:
            return self._socket.sendmsg((header, payload), (), socket.MSG_DONTWAIT)
        except BlockingIOError:
            return 0
        except OSError:
            self.is_open = False
            return len(header) + len(payload)

    def _append(self, channel: int, data: bytes, depth: int) -> None:
        if depth and self._queued.get(channel, 0) >= depth:
            # The first one may be on its way already; it is known by the channel -1.
            self._queue.remove(next(item for item in self._queue if item[0] == channel))
            self._queued[channel] -= 1
            self.dropped[channel] = self.dropped.get(channel, 0) + 1
        self._queue.append((channel, data))
        self._queued[channel] = self._queued.get(channel, 0) + 1

    def _write(self) -> None:
        while True:
            with self._lock:
                while self.is_open and not self._queue:
                    self._waits.wait()
                if not self.is_open:
                    return
                channel, data = self._queue[0]
                self._queue[0] = (-1, data)  # it cannot be dropped any more
                self._queued[channel] -= 1
                self._queued[-1] = self._queued.get(-1, 0) + 1
            try:
                self._socket.sendall(data)
            except OSError:
                self.is_open = False
                return
            with self._lock:
                self._queue.popleft()
                self._queued[-1] -= 1


def _read(stream: Any, size: int) -> bytes:
    try:
        data: bytes = stream.read(size)
    except OSError:
        return b""  # the other side was killed
    return data
