"""The supervisor's door: a unix socket in the robot's folder that answers one request per connection.

A request is a line of JSON as `Family` of `typed_json` writes it; the answer is `{"answer": ...}`, with data of the
request's answer type, or `{"refused": "why"}`.
"""

import json
import os
import selectors
import socket
import struct
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field
from pathlib import Path
from typing import Any, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused, Request, UnreadableError, from_data, requests
from rbxcompose.runtime.folder import SOCKET, RobotFolder
from rbxcompose.runtime.processes import Process

A = TypeVar("A")

_MOST = 64_000_000  # [B] of a request; the plan of a large robot is one
_CHUNK = 262144  # [B] per read
_BACKLOG = 128
_MOST_OPEN = 64  # connections; a program that forgets to close its own must not block `stop`
_TIMEVAL = struct.Struct("ll")  # seconds, microseconds
_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid

ANSWER = 2.0  # [s] in which a live supervisor answers

Handle = Callable[[object, int], None]  # request as data, number of the connection


class NoAnswerError(OSError):
    """Raised when the supervisor does not answer."""


@contextmanager
def _short_address(folder: Path) -> Iterator[str]:
    # The address of a unix socket has at most 107 characters; the path of a descriptor is short.
    descriptor = os.open(folder, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield f"/proc/self/fd/{descriptor}/{SOCKET}"
    finally:
        os.close(descriptor)


@dataclass(slots=True)
class _Connection:
    """A client: what has arrived of its request, and what it has not taken yet of the answer."""

    socket: socket.socket
    received: bytearray = field(default_factory=bytearray)
    unsent: bytearray = field(default_factory=bytearray)


class ControlServer:
    """Takes requests of this user; each is answered once, now or later, by its number."""

    def __init__(self, folder: RobotFolder, selector: selectors.BaseSelector) -> None:
        """Open the door; `handle` must be set before the first request is read."""
        self.handle: Handle = lambda request, number: self.refuse(number, "nobody is here")
        self._selector = selector
        self._folder = folder
        self._connections: dict[int, _Connection] = {}
        self._count = 0
        self._listener = self._listen()

    def open_again(self) -> None:
        """Open the door again at its old path if its file is gone."""
        if not (self._folder.path / SOCKET).exists():
            listener = self._listen()
            self._selector.unregister(self._listener)
            self._listener.close()
            self._listener = listener

    def _listen(self) -> socket.socket:
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            listener.setblocking(False)
            with _short_address(self._folder.path) as address:
                listener.bind(address)
            listener.listen(_BACKLOG)
        except OSError:
            listener.close()
            raise
        self._selector.register(listener, selectors.EVENT_READ, self._accept)
        return listener

    def answer(self, number: int, answer: object) -> None:
        """Answer a request."""
        self._reply(number, {"answer": answer})

    def refuse(self, number: int, reason: str) -> None:
        """Refuse a request."""
        self._reply(number, {"refused": reason})

    def close(self) -> None:
        """Close the door; clients that still wait see the end of their connections."""
        for number in list(self._connections):
            self._drop(number)
        self._selector.unregister(self._listener)
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return  # it is gone again
        credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        if _CREDENTIALS.unpack(credentials)[1] != os.getuid():
            connection.close()
            return
        connection.setblocking(False)
        if len(self._connections) >= _MOST_OPEN:
            self._drop(next(iter(self._connections)))  # the oldest
        self._count += 1
        number = self._count
        self._connections[number] = _Connection(connection)
        self._selector.register(connection, selectors.EVENT_READ, lambda: self._serve(number))

    def _serve(self, number: int) -> None:
        """Send the rest of an answer, or read more of a request."""
        if self._connections[number].unsent:
            self._send(number)
        else:
            self._read(number)

    def _read(self, number: int) -> None:
        client = self._connections[number]
        received = client.received
        try:
            chunk = client.socket.recv(_CHUNK)
        except BlockingIOError:
            return
        except OSError:
            chunk = b""
        received += chunk
        if not chunk or len(received) > _MOST:
            self._drop(number)
        elif received.endswith(b"\n"):
            self._request(number, bytes(received))
            received.clear()

    def _request(self, number: int, line: bytes) -> None:
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):  # no JSON, or nested too deeply
            self.refuse(number, "this is not a request")
        else:
            self.handle(request, number)

    def _reply(self, number: int, reply: object) -> None:
        client = self._connections.get(number)
        if client is not None:  # else it did not wait
            client.unsent += json.dumps(reply).encode() + b"\n"
            self._send(number)

    def _send(self, number: int) -> None:
        """Send as much of the answer as the client takes now; the rest follows when it takes more."""
        client = self._connections[number]
        try:
            del client.unsent[: client.socket.send(client.unsent)]
        except BlockingIOError:
            pass  # its buffer is full
        except OSError:
            self._drop(number)  # it is gone
            return
        self._selector.modify(
            client.socket, selectors.EVENT_WRITE if client.unsent else selectors.EVENT_READ, lambda: self._serve(number)
        )

    def _drop(self, number: int) -> None:
        connection = self._connections.pop(number).socket
        self._selector.unregister(connection)
        connection.close()


def supervisor_of(folder: RobotFolder) -> Process | None:
    """Return the process of this user that listens at the control socket, even if suspended; None if none does.

    The kernel identifies it, so no file has to be trusted.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(ANSWER)
        try:
            with _short_address(folder.path) as address:
                connection.connect(address)
            credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
            pid, uid, _ = _CREDENTIALS.unpack(credentials)
            return Process.of(pid) if uid == os.getuid() else None
        except OSError:  # nobody listens, or not any more
            return None


def ask(folder: RobotFolder, request: Request[A], *, timeout: float = ANSWER) -> A:
    """Send a request to a robot's supervisor and return the answer.

    Raises:
        NoAnswerError: if there is no supervisor, or it does not answer within `timeout` [s].
        Refused: if it refuses, or answers as another version of rbxcompose would.
    """
    data = ask_as_data(folder, requests(type(request)).to_data(request), timeout=timeout)
    try:
        answer: A = from_data(request.answer_type(), data)
    except UnreadableError as error:
        raise Refused(f"its answer is from another version of rbxcompose: {error}") from error
    return answer


def ask_as_data(folder: RobotFolder, request: Mapping[str, Any], *, timeout: float = ANSWER) -> Any:
    """Send a request as data, and return the answer as data; the rest is as in `ask`."""
    reply = json.loads(_exchange(folder, json.dumps(request).encode() + b"\n", timeout))
    if "refused" in reply:
        raise Refused(reply["refused"])
    return reply["answer"]


def _exchange(folder: RobotFolder, line: bytes, timeout: float) -> bytes:
    """Send a line and return the line that the supervisor answers."""
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection, _short_address(folder.path) as address:
            # Blocking, with a timeout: a non-blocking connection fails immediately while others wait at the door.
            limit = _TIMEVAL.pack(int(timeout), int(timeout % 1 * 1e6))
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
            connection.connect(address)
            connection.settimeout(timeout)
            connection.sendall(line)
            with connection.makefile("rb") as file:
                reply = file.readline()
    except (OSError, TimeoutError) as error:
        raise NoAnswerError(str(error)) from error
    if not reply.endswith(b"\n"):
        raise NoAnswerError("the supervisor has closed the connection")
    return reply
