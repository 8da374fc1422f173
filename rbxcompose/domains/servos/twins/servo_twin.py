"""Simulated servos in place of a bus: as memory, or behind a pseudo-terminal for the driver.

The pseudo-terminal has a path that stays while it is unplugged and plugged in again. A physics engine may move their
shafts: it gets set points, and says what it measures.
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

from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.devices.serial_ports import LostPortError
from rbxcompose.domains.servos.bus import FoundServo, ServoReading, ServoStatistics
from rbxcompose.domains.servos.joint_drive import JointServo, ServoJoint
from rbxcompose.domains.servos.twins.servo_fake import FakeServo, ServoMotor
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

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
        self.statistics = {servo.id: ServoStatistics() for servo in self.line.servos}
        self._is_out = False

    def unplug(self) -> None:
        """Take the bus away."""
        self._is_out = True

    def replug(self) -> None:
        """Bring it back."""
        self._is_out = False

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
                statistics = self.statistics[id_]
                statistics.misses, statistics.last_seen = 0, now
                yield id_, servo

    def _is_understood(self, servo: FakeServo) -> bool:
        """Tell whether a driver would understand the reply of a servo; count it if not."""
        faults = servo.faults
        is_missing = faults.is_off or faults.is_mute or faults.delay > PATIENCE or faults.id is not None
        is_spoilt = faults.corrupts or faults.cuts > 0
        if is_missing or is_spoilt:
            statistics = self.statistics[servo.id]
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
            self.statistics[id_].reads += 1
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


WINDUP = 0.5  # [rad] that the profile of one that turns gets ahead of a shaft that is held, at most


class PhysicsMotor(ServoMotor):
    """A motor whose profile leads to its goal, and whose shaft is where an engine moves it."""

    share = 0.0
    """How much of its torque it may use; 0 while it is relaxed."""

    def __init__(self, position: float, per_tick: float) -> None:
        super().__init__(position, per_tick)
        self._ahead = WINDUP / per_tick

    @property
    def aim(self) -> float:
        """Return where its profile is [ticks]."""
        return self._aim

    @property
    def speed(self) -> float:
        """Return how fast its profile moves [ticks/s]."""
        return self._speed

    def feel(self, position: float, velocity: float, effort: float) -> None:
        """Take over what was measured [ticks, ticks/s, part of the most]."""
        self.position, self.velocity, self.effort = position, velocity, max(-1.0, min(1.0, effort))

    def put(self, position: float) -> None:
        """Aim there, at rest: only the engine moves the shaft."""
        self._aim, self._speed = position, 0.0

    def relax(self) -> None:
        """Let go."""
        self.put(self.position)
        self.share = 0.0

    def push(self, effort: float) -> None:
        """Aim where it does, at rest, with what torque it has."""
        self._speed = 0.0

    def turn(self, speed: float, acceleration: float, dt: float, circle: int = 0, share: float = 1.0) -> None:
        """Let the profile turn at a speed [ticks/s], without end."""
        measured = self.position, self.velocity, self.effort
        ahead = max(-self._ahead, min(self._ahead, self._aim - self.position))
        self.position, self.share = self.position + ahead, share
        super().turn(speed, acceleration, dt, 0, share)
        self.feel(*measured)

    def approach(self, goal: float, fastest: float, acceleration: float, dt: float, share: float = 1.0) -> None:
        """Lead the profile towards a goal."""
        self.share = share
        super().approach(goal, fastest, acceleration, dt, share)

    def _follow(self, kept: float, step: float) -> None:
        """Leave the shaft to the engine."""


@dataclass(frozen=True, slots=True)
class _Shaft:
    """A servo of a joint, and its motor."""

    servo: JointServo
    motor: PhysicsMotor

    @property
    def angle(self) -> float:
        """Return the angle at which it aims [rad]."""
        return (self.motor.aim - self.servo.neutral) * self.servo.per_tick

    @property
    def speed(self) -> float:
        """Return at which it turns there [rad/s]."""
        return self.motor.speed * self.servo.per_tick


class PhysicsJoints:
    """The link of joints and their simulated servos to an engine; `is_felt` tells whether it has reported all."""

    def __init__(self, joints: Sequence[ServoJoint], servos: Mapping[str, Sequence[FakeServo]]) -> None:
        self._joints = {joint.name: joint for joint in joints}
        self._unfelt = set(self._joints)
        self._shafts = {
            name: [
                _Shaft(servo, fake.motor)
                for servo, fake in zip(joint.servos, servos[name], strict=True)
                if isinstance(fake.motor, PhysicsMotor)
            ]
            for name, joint in self._joints.items()
        }

    @property
    def is_felt(self) -> bool:
        """Return whether the engine has reported where all joints are."""
        return not self._unfelt

    def set_points(self, stamp: int) -> JointState:
        """Return where each joint is to be [rad or m] at a time [ns]; `effort` is the part of its most."""
        found = [self._set_point(joint) for joint in self._joints.values()]
        positions, velocities, shares = np.array(found).reshape(-1, 3).T
        return JointState(Header(stamp=to_time(stamp)), tuple(self._joints), positions, velocities, shares)

    def _set_point(self, joint: ServoJoint) -> tuple[float, float, float]:
        shafts, gear = self._shafts[joint.name], joint.transmission
        pulling = [shaft for shaft in shafts if shaft.motor.share] or shafts
        position = sum(gear.position(shaft.angle) for shaft in pulling) / len(pulling)
        velocity = sum(gear.slope(shaft.angle) * shaft.speed for shaft in pulling) / len(pulling)
        return position, velocity, sum(shaft.motor.share for shaft in shafts) / len(shafts)

    def feel(self, message: JointState) -> None:
        """Take over where the joints are, how they move, and which part of the most effort they feel."""
        rows = zip(message.name, message.position, message.velocity, message.effort, strict=True)
        for name, position, velocity, effort in rows:
            if (joint := self._joints.get(name)) is None:
                continue
            angle = joint.transmission.angle(float(position))
            slope = joint.transmission.slope(angle)
            for servo, motor in ((shaft.servo, shaft.motor) for shaft in self._shafts[name]):
                per_tick = servo.per_tick
                load = effort if slope * per_tick > 0 else -effort
                motor.feel(servo.neutral + angle / per_tick, velocity / (slope * per_tick), load)
            self._unfelt.discard(name)
