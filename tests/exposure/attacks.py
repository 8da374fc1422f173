"""What strangers may do to a socket. Each attack is a context: what it holds open stays open until it is left."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial

Connect = Callable[[], socket.socket]
Attack = Callable[[Connect], AbstractContextManager[None]]

PATIENCE = 5.0  # [s] for what a stranger sends
CROWD = 200
MUCH = 70_000_000  # [B], more than any request may have


@contextmanager
def sending(data: bytes, connect: Connect) -> Iterator[None]:
    """Send bytes, and do not read what comes back."""
    with connect() as connection:
        connection.settimeout(PATIENCE)
        with suppress(OSError):  # to be cut off in the middle is what should happen
            connection.sendall(data)
        yield


@contextmanager
def crowding(first: bytes, connect: Connect) -> Iterator[None]:
    """Open many connections, send the beginning of something on each, and go on holding them."""
    with ExitStack() as stack:
        for _ in range(CROWD):
            with suppress(OSError):  # turned away
                connection = stack.enter_context(connect())
                connection.settimeout(PATIENCE)
                connection.sendall(first)
        yield


@contextmanager
def flooding(data: bytes, times: int, connect: Connect) -> Iterator[None]:
    """Send the same again and again without reading the answers."""
    with connect() as connection:
        connection.settimeout(0.2)
        with suppress(OSError):
            for _ in range(times):
                connection.sendall(data)
        yield


@contextmanager
def resetting(connect: Connect) -> Iterator[None]:
    """Connect, send a little and reset the connection, many times."""
    for _ in range(CROWD):
        with suppress(OSError), connect() as connection:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            connection.sendall(b"\x05")
    yield


def _line(request: object) -> bytes:
    return json.dumps(request).encode() + b"\n"


REQUESTS = {
    "no JSON": b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n",
    "no text": bytes(range(256)) + b"\n",
    "nested without end": b"[" * 200_000 + b"\n",
    "nested objects without end": b'{"a":' * 200_000 + b"\n",
    "a number without end": b'{"type": ' + b"9" * 100_000 + b"}\n",
    "a list": _line(["stop"]),
    "a name that is none": _line({"type": {"stop": []}}),
    "a name of Python": _line({"type": "__class__"}),
    "a request of another version": _line({"verb": "stop"}),
    "a command of wrong types": _line({"type": "mission.PauseMission", "mission": [1]}),
    "a command nested almost without end": b'{"type": "mission.RunMission", "mission": %s}\n'
    % (b"[" * 900 + b"]" * 900),
    "a command with more than it has": _line({"type": "robot.StopRobot", "force": True}),
    "a plan that is none": _line({"type": "robot.ApplyPlan", "plan": {"robot": 5}, "generation": "x"}),
    "a plan nested without end": _line({"type": "robot.ComparePlan", "plan": "[" * 100_000}),
    "terminal codes": _line({"type": "\x1b[2Jstop\r\n"}),
}
ON_CONTROL: dict[str, Attack] = {
    "more than it may be": partial(sending, b"x" * MUCH),
    "half a request, 200 times": partial(crowding, b'{"type": "do'),
    "nothing, 200 times": partial(crowding, b""),
    "answers that nobody reads": partial(flooding, _line({"type": "robot.RobotStatus"}) * 50, 50),
    "resets": resetting,
}
ON_ROUTER: dict[str, Attack] = {
    "HTTP": partial(sending, REQUESTS["no JSON"]),
    "zeros": partial(sending, bytes(1_000_000)),
    "bytes of all kinds": partial(sending, bytes(range(256)) * 4000),
    "a frame that is longer than told": partial(sending, b"\xff\xff" + b"\x01" * 70_000),
    "half a frame": partial(sending, b"\x40\x00\x01"),
    "half a frame, 200 times": partial(crowding, b"\x40\x00\x01"),
    "nothing, 200 times": partial(crowding, b""),
    "resets": resetting,
}
