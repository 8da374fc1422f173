"""The far end of buses of servos for benchmarks: canned replies to sync reads, as late as a wire would have them.

A process of its own serves pseudo-terminals. Like a USB adapter, it hands over once in a millisecond what has come.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import select
import time
import tty
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path

from rbxcompose.domains.servos.twins.servo_line import SYNC_READ, ServoPacket, packets, status

BAUD = 1_000_000  # [bit/s]
_BITS, _SLICE = 10, 0.001  # of a byte on the wire; [s]


def _replies(packet: ServoPacket, canned: dict[int, bytes]) -> bytes:
    return b"".join(canned.get(servo, b"") for servo in packet.parameters[4:])


def _serve(count: int, length: int, mute: Sequence[int], ready: Connection) -> None:
    """Answer on `count` terminals until the other process ends."""
    canned = {index: status(2, index, 0, bytes([index] * length)) for index in range(1, 253) if index not in mute}
    ends = [os.openpty() for _ in range(count)]
    for _, near in ends:
        tty.setraw(near)
    ready.send([os.ttyname(near) for _, near in ends])
    buffers = {far: bytearray() for far, _ in ends}
    end = ready.fileno()
    while True:
        for far in select.select([*buffers, end], [], [])[0]:
            if far == end:
                return
            data = os.read(far, 4096)
            buffers[far] += data
            for packet in packets(buffers[far]):
                if packet.instruction == SYNC_READ:
                    _send(far, _replies(packet, canned), len(data))


def _send(far: int, data: bytes, asked: int) -> None:
    """Write replies to a request of `asked` bytes when the wire would have carried them."""
    due = time.monotonic() + _BITS * asked / BAUD
    step = int(_SLICE * BAUD / _BITS)  # [B]
    for start in range(0, len(data), step):
        piece = data[start : start + step]
        due += _BITS * len(piece) / BAUD
        time.sleep(max(0.0, due - time.monotonic()))
        os.write(far, piece)


@contextlib.contextmanager
def served(count: int, length: int, mute: Sequence[int] = ()) -> Iterator[list[Path]]:
    """Give the paths of terminals behind which all servos but the mute ones answer with `length` bytes."""
    context = multiprocessing.get_context("spawn")
    near, far = context.Pipe()
    process = context.Process(target=_serve, args=(count, length, mute, far))
    process.start()
    try:
        yield [Path(name) for name in near.recv()]
    finally:
        near.send("end")
        process.join(10.0)
