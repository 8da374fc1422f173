"""Servos behind a pseudo-terminal of their own, for a driver that wants the path of a serial port."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rbxcompose.twins.servo_fake import FakeServo
from rbxcompose.twins.servo_line import FakeLine
from rbxcompose.twins.servo_port import FakePort


@contextmanager
def pseudo_terminal(models: Mapping[int, str]) -> Iterator[str]:
    """Lend the path of a terminal behind which servos of these models answer at their ids, in real time."""
    line = FakeLine([FakeServo(model, id_) for id_, model in models.items()], time.monotonic)
    with tempfile.TemporaryDirectory() as folder, FakePort(line, Path(folder) / "servos", has_wire_time=True) as port:
        yield str(port.path)
