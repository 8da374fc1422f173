"""Simulated servos in place of a bus: as memory, or behind a pseudo-terminal for the driver of a serial port."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from rbxcompose.actuation.servo_joint import ServoJoint
from rbxcompose.twins.servo_fake import FakeServo
from rbxcompose.twins.servo_line import FakeLine
from rbxcompose.twins.servo_port import FakePort
from rbxcompose.twins.servo_twin import TwinBus


def twin_servos(
    joints: Iterable[ServoJoint], *, is_ideal: bool = False, noise: float = 0.0, seed: int = 0
) -> dict[str, list[FakeServo]]:
    """Return simulated servos by joint; `noise` [rad] is the standard deviation of the positions that they measure."""
    return {
        joint.name: [
            FakeServo(one.model, one.id, is_ideal=is_ideal, noise=noise / one.model.per_tick, seed=seed)
            for one in joint.servos
        ]
        for joint in joints
    }


@contextmanager
def pseudo_terminal(servos: Iterable[FakeServo]) -> Iterator[FakePort]:
    """Lend a terminal behind which these servos answer, in real time; its `path` is that of a serial port."""
    line = FakeLine(servos, time.monotonic)
    with tempfile.TemporaryDirectory() as folder, FakePort(line, Path(folder) / "servos", has_wire_time=True) as port:
        yield port


@contextmanager
def twin_of(
    servos: Mapping[str, Sequence[FakeServo]], clock: Callable[[], float], *, has_bytes: bool
) -> Iterator[TwinBus | FakePort]:
    """Lend the servos of some joints as a bus, which moves with a clock, or as a port that takes bytes."""
    found = [servo for those in servos.values() for servo in those]
    if not has_bytes:
        yield TwinBus(found, clock)
        return
    with pseudo_terminal(found) as port:
        yield port
