"""Several fake servos on one line: bytes of requests in, replies with their times out."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.twins import servo_packets as wire
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_packets import ServoPacket, crc_of, packet_two, packets, status

_BITS = 10  # of a byte on the wire
_TOLERANCE = 0.03  # of a UART
_INSTRUCTION = {1: 64, 2: 2}  # the result of an instruction that is not known
_RANGE = {1: 8, 2: 4}


@dataclass(frozen=True, slots=True)
class FakeReply:
    """Bytes that appear on the wire `after` [s] the end of the request; `late` [s] of it is a fault."""

    after: float
    data: bytes
    late: float = 0.0


class FakeLine:
    """Servos on one wire; `clock` gives the time [s] by which they move."""

    def __init__(self, servos: Iterable[FakeServo], clock: Callable[[], float]) -> None:
        self.servos = list(servos)
        self.received: list[ServoPacket] = []  # every instruction so far
        self._clock, self._now = clock, clock()
        self._buffer = bytearray()
        self._lock = threading.RLock()
        for servo in self.servos:
            servo.heard = self._now

    def __getitem__(self, id: int) -> FakeServo:
        """Return the servo with this id, as it is now."""
        self.advance()
        return next(servo for servo in self.servos if servo.id == id)

    def advance(self) -> None:
        """Let all servos move until now."""
        with self._lock:
            now = self._clock()
            if now > self._now:
                for servo in self.servos:
                    servo.step(now - self._now, now)
                self._now = now

    def receive(self, data: bytes, baud: int | None = None) -> list[FakeReply]:
        """Take bytes at a rate [bit/s]; servos that listen at another one hear nothing. Return the replies in order."""
        with self._lock:
            self.advance()
            self._buffer += data
            replies: list[FakeReply] = []
            for packet in packets(self._buffer):
                self.received.append(packet)
                replies += self._timed(packet, baud or 1_000_000, self._listening(packet.protocol, baud))
            return replies

    def _listening(self, protocol: int, baud: int | None) -> list[FakeServo]:
        powered = (fake_servo for fake_servo in self.servos if not fake_servo.faults.is_off)
        found = [item for item in powered if baud is None or abs(item.baud - baud) <= _TOLERANCE * baud]
        for servo in found:
            servo.heard = self._now
        return [fake_servo for fake_servo in found if fake_servo.model.protocol == protocol]

    def _timed(self, packet: ServoPacket, baud: int, servos: list[FakeServo]) -> Iterator[FakeReply]:
        """Yield the replies to a packet, one after the other on the wire."""
        after = 0.0
        for servo, data in self._answers(packet, servos):
            faults = servo.faults
            if faults.is_mute:
                if faults.silences_next:
                    return
                continue
            after += servo.model.to_si("return_delay", servo.get("return_delay"))
            for _ in range(faults.repeats):
                spoilt = _spoilt(data, servo)
                after += _BITS * len(spoilt) / baud
                yield FakeReply(after, spoilt, faults.delay)

    def _answers(self, packet: ServoPacket, servos: list[FakeServo]) -> Iterator[tuple[FakeServo, bytes]]:
        """Carry out an instruction; yield who replies with what."""
        match packet.instruction:
            case wire.SYNC_READ | wire.FAST_SYNC_READ | wire.BULK_READ | wire.SYNC_WRITE if packet.id == wire.BROADCAST:
                yield from self._of_group(packet, servos)
                return
        for servo in sorted(servos, key=lambda fake_servo: fake_servo.id):
            if packet.id in (servo.id, wire.BROADCAST):
                answer = self._single(packet, servo)
                speaks = packet.id != wire.BROADCAST or packet.instruction == wire.PING
                level = servo.get("status_return_level") if "status_return_level" in servo.model.items else 2
                if speaks and level >= {wire.PING: 0, wire.READ: 1}.get(packet.instruction, 2):
                    yield servo, answer

    def _single(self, packet: ServoPacket, servo: FakeServo) -> bytes:
        given, protocol, own = packet.parameters, packet.protocol, servo.id
        wide = 2 if protocol == 2 else 1  # [B] of an address or a length
        match packet.instruction:
            case wire.PING:
                found = bytes(servo.memory[:2]) + b"\x2d" if protocol == 2 else b""  # model number and firmware
                return status(protocol, own, servo.alert, found)
            case wire.READ if len(given) >= 2 * wide:
                return self._read(servo, _number(given[:wide]), _number(given[wide : 2 * wide]))
            case wire.WRITE if len(given) > wide:
                result = servo.write(_number(given[:wide]), given[wide:])
                return status(protocol, own, servo.alert | result)
            case wire.REBOOT if protocol == 2:
                alert = servo.alert
                servo.reboot()
                return status(protocol, own, alert)
        return status(protocol, own, servo.alert | _INSTRUCTION[protocol])

    def _read(self, servo: FakeServo, address: int, length: int) -> bytes:
        protocol, data = servo.model.protocol, servo.read(address, length)
        if data is None:
            return status(protocol, servo.id, servo.alert | _RANGE[protocol])
        return status(protocol, servo.id, servo.alert, data)

    def _of_group(self, packet: ServoPacket, servos: list[FakeServo]) -> Iterator[tuple[FakeServo, bytes]]:
        given = packet.parameters
        by_id = {servo.id: servo for servo in servos}
        match packet.instruction, packet.protocol:
            case (wire.SYNC_WRITE, protocol):
                _write_all(given, protocol, by_id)
            case (wire.SYNC_READ, 2):
                asked = [by_id[one] for one in given[4:] if one in by_id]
                for servo in asked:
                    yield servo, self._read(servo, _number(given[:2]), _number(given[2:4]))
            case (wire.FAST_SYNC_READ, 2):
                asked = [by_id[one] for one in given[4:] if one in by_id]
                yield from _fast(asked, _number(given[:2]), _number(given[2:4]))
            case (wire.BULK_READ, 2):
                for number, address, length in _triples_two(given):
                    if number in by_id:
                        yield by_id[number], self._read(by_id[number], address, length)
            case (wire.BULK_READ, 1):
                for length, number, address in zip(given[1::3], given[2::3], given[3::3], strict=False):
                    if number in by_id and by_id[number].model.family.has_bulk_read:
                        yield by_id[number], self._read(by_id[number], address, length)


def _number(data: bytes) -> int:
    return int.from_bytes(data, "little")


def _triples_two(given: bytes) -> Iterator[tuple[int, int, int]]:
    for start in range(0, len(given) - 4, 5):
        yield given[start], _number(given[start + 1 : start + 3]), _number(given[start + 3 : start + 5])


def _write_all(given: bytes, protocol: int, by_id: dict[int, FakeServo]) -> None:
    wide = 2 if protocol == 2 else 1
    address, length = _number(given[:wide]), _number(given[wide : 2 * wide])
    for start in range(2 * wide, len(given) - length, length + 1):
        if servo := by_id.get(given[start]):
            servo.write(address, given[start + 1 : start + 1 + length])


def _fast(asked: list[FakeServo], address: int, length: int) -> Iterator[tuple[FakeServo, bytes]]:
    """Yield the parts of the one packet that all servos write together; each ends with the CRC of all before it."""
    whole = b"\xff\xff\xfd\x00\xfe" + (len(asked) * (length + 4) + 1).to_bytes(2, "little") + bytes([wire.STATUS])
    begun = 0
    for servo in asked:
        if servo.faults.is_mute:
            return
        whole += bytes([servo.alert, servo.id]) + (servo.read(address, length) or bytes(length))
        whole += crc_of(whole).to_bytes(2, "little")
        yield servo, whole[begun:]
        begun = len(whole)


def _spoilt(data: bytes, servo: FakeServo) -> bytes:
    faults = servo.faults
    if faults.id is not None:
        data = _renamed(data, servo.model.protocol, faults.id)
    if faults.corrupts:
        data = data[:-1] + bytes([data[-1] ^ 0x10])
    return faults.garbage + data[: len(data) - faults.cuts]


def _renamed(data: bytes, protocol: int, id: int) -> bytes:
    """Return a status with another id and the right checksum."""
    if protocol == 1:
        return status(1, id, data[4], data[5:-1])
    return packet_two(id, wire.STATUS, data[8:-2])
