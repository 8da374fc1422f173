"""Simulated servos in place of a bus: as memory, or behind a pseudo-terminal for the driver.

The pseudo-terminal has a path that stays while it is unplugged and plugged in again.
"""

from __future__ import annotations

import fcntl
import heapq
import itertools
import os
import select
import struct
import tempfile
import threading
import time
import tty
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from rbxcompose.domains.devices.serial_ports import LostPortError
from rbxcompose.domains.servos.bus import FoundServo, ServoReading, ServoStatistics
from rbxcompose.domains.servos.joint_drive import ServoJoint
from rbxcompose.domains.servos.twins.servo_fake import FakeServo, ServoMotor
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


PATIENCE = 0.002  # [s] after which a driver gives a reply up


class TwinBus:
    """A bus whose servos answer at once; those whose replies a driver could not use do not."""

    def __init__(self, servos: Iterable[FakeServo], clock: Callable[[], float]) -> None:
        self.line = FakeLine(servos, clock)
        self._clock = clock
        self._statistics = {servo.id: ServoStatistics() for servo in self.line.servos}
        self._is_out = False

    def unplug(self) -> None:
        """Take the bus away."""
        self._is_out = True

    def replug(self) -> None:
        """Bring it back."""
        self._is_out = False

    @property
    def statistics(self) -> Mapping[int, ServoStatistics]:
        """Return how well each servo answers, by id."""
        return self._statistics

    def _asked(self, ids: Iterable[int]) -> Iterator[tuple[int, FakeServo]]:
        """Yield the servos of a request by their ids; those with power hear it, and obey also if they do not answer."""
        if self._is_out:
            raise LostPortError("the simulated bus", "is unplugged")
        self.line.advance()
        wanted, now = set(ids), self._clock()
        for servo in self.line.servos:
            if (id_ := servo.id) in wanted:
                if not servo.faults.is_off:
                    servo.heard = now
                yield id_, servo

    def _answering(self, ids: Iterable[int]) -> Iterator[tuple[int, FakeServo]]:
        now = self._clock()
        for id_, servo in self._asked(ids):
            if self._is_understood(servo):
                statistics = self._statistics[id_]
                statistics.misses, statistics.last_seen = 0, now
                yield id_, servo

    def _is_understood(self, servo: FakeServo) -> bool:
        """Tell whether a driver would understand the reply of a servo; count it if not."""
        faults = servo.faults
        is_missing = faults.is_off or faults.is_mute or faults.delay > PATIENCE or faults.id is not None
        is_spoilt = faults.corrupts or faults.cuts > 0
        if is_missing or is_spoilt:
            statistics = self._statistics[servo.id]
            statistics.misses += 1
            statistics.timeouts += is_missing
            statistics.errors += not is_missing
        return not (is_missing or is_spoilt)

    def ping(self, id: int) -> FoundServo | None:
        """Return the servo at an id, None if it is silent."""
        return next(self.scan([id]), None)

    def scan(self, ids: Iterable[int]) -> Iterator[FoundServo]:
        """Yield the servos that answer."""
        for id_, servo in self._answering(ids):
            yield FoundServo(id_, servo.model.protocol, servo.model.number, servo.baud)

    def read(self, ids: Sequence[int], items: Sequence[str], *, budget: float | None = None) -> dict[int, ServoReading]:
        """Return the items of all servos that answered."""
        found, now = {}, self._clock()
        for id_, servo in self._answering(ids):
            self._statistics[id_].reads += 1
            found[id_] = ServoReading({item: servo.get(item) for item in items}, now, servo.alert)
        return found

    def write(self, values: Mapping[int, Mapping[str, int]], *, is_confirmed: bool = False) -> set[int]:
        """Write raw values, by id and item; return the ids that failed."""
        failed = set(values)
        for id_, servo in self._asked(values):
            if servo.faults.is_off:
                continue
            items = ((servo.model.item(name), raw) for name, raw in values[id_].items())
            results = [servo.write(item.address, item.encode(raw)) for item, raw in items]
            if not any(results) and (not is_confirmed or self._is_understood(servo)):
                failed.discard(id_)
        return failed if is_confirmed else set()

    def reboot(self, id: int) -> bool:
        """Start a servo again, torque off."""
        found = [servo for _, servo in self._asked([id])]
        for servo in found:
            servo.reboot()
        return any(map(self._is_understood, found))

    def reopen(self, *, is_relaxed: bool = True) -> dict[int, FoundServo | None]:
        """Return who answers at each id, relaxed."""
        if is_relaxed:
            self.write({servo.id: {"torque_enable": 0} for servo in self.line.servos})
        return {servo.id: self.ping(servo.id) for servo in self.line.servos}

    def close(self) -> None:
        """Do nothing: there is no port."""


def twin_servos(
    joints: Iterable[ServoJoint], *, motor: type[ServoMotor] = ServoMotor, noise: float = 0.0, seed: int = 0
) -> dict[str, list[FakeServo]]:
    """Return simulated servos by joint; `noise` [rad] is the standard deviation of the positions that they measure."""
    return {
        joint.name: [
            FakeServo(servo.model, servo.id, motor=motor, noise=noise / servo.model.per_tick, seed=seed)
            for servo in joint.servos
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
