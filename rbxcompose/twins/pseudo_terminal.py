"""Servos behind a pseudo-terminal of their own, for a driver that wants the path of a serial port."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rbxcompose.twins.servo_fake import FakeServo
from rbxcompose.twins.servo_line import FakeLine
from rbxcompose.twins.servo_port import FakePort


@contextmanager
def pseudo_terminal(servos: Iterable[FakeServo]) -> Iterator[FakePort]:
    """Lend a terminal behind which these servos answer, in real time; its `path` is that of a serial port."""
    line = FakeLine(servos, time.monotonic)
    with tempfile.TemporaryDirectory() as folder, FakePort(line, Path(folder) / "servos", has_wire_time=True) as port:
        yield port
