"""Several fake servos on one line: bytes of requests in, replies with their times out.

Packets of both Dynamixel protocols are as servos see them: instructions are taken out of bytes, statuses are made. This
is written from ROBOTIS's description of the protocols and independently of its SDK, which it tests.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.twins.servo_fake import FakeServo

BROADCAST = 254
PING, READ, WRITE, REBOOT, STATUS = 0x01, 0x02, 0x03, 0x08, 0x55
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ, BULK_READ = 0x82, 0x83, 0x8A, 0x92
_ONE, _TWO = b"\xff\xff", b"\xff\xff\xfd\x00"
_POLYNOMIAL = 0x8005


@dataclass(frozen=True, slots=True)
class ServoPacket:
    """One instruction, without what frames it."""

    protocol: int
    id: int
    instruction: int
    parameters: bytes


def crc_of(data: bytes) -> int:
    """Return the CRC-16 of protocol 2.0: polynomial 0x8005, most significant bit first, start at 0."""
    crc = 0
    for byte in data:
        crc = (crc << 8) & 0xFFFF ^ _CRC[crc >> 8 ^ byte]
    return crc


def _crc_of_byte(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1) ^ (_POLYNOMIAL if crc & 0x8000 else 0)
    return crc & 0xFFFF


_CRC = tuple(map(_crc_of_byte, range(256)))


def packet_one(id: int, code: int, parameters: bytes = b"") -> bytes:
    """Return a packet of protocol 1.0; `code` is the instruction, or the error byte of a status."""
    body = bytes([id, len(parameters) + 2, code]) + parameters
    return _ONE + body + bytes([~sum(body) & 0xFF])


def packet_two(id: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Return a packet of protocol 2.0, stuffed; a status begins its parameters with the error byte."""
    body = (bytes([instruction]) + parameters).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    packet = _TWO + bytes([id]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc_of(packet).to_bytes(2, "little")


def status(protocol: int, id: int, error: int, parameters: bytes = b"") -> bytes:
    """Return the packet with which a servo answers."""
    if protocol == 1:
        return packet_one(id, error, parameters)
    return packet_two(id, STATUS, bytes([error]) + parameters)


def _plain(body: bytes) -> bytes:
    return body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


def packets(buffer: bytearray) -> Iterator[ServoPacket]:
    """Take all whole packets from the beginning of received bytes; what can be none is dropped."""
    while (start := buffer.find(_ONE)) >= 0:
        del buffer[:start]
        length = _length(buffer)
        if length is None or len(buffer) < length:
            return
        packet = _packet(bytes(buffer[:length]))
        del buffer[: length if packet else 1]
        if packet:
            yield packet
    del buffer[: max(0, len(buffer) - 1)]


def _length(buffer: bytearray) -> int | None:
    """Return the length of the packet that begins here [B], None if too little of it is there."""
    if buffer[:4] == _TWO:
        return int.from_bytes(buffer[5:7], "little") + 7 if len(buffer) >= 7 else None
    return max(buffer[3] + 4, 6) if len(buffer) >= 4 else None


def _packet(data: bytes) -> ServoPacket | None:
    """Return the packet in these bytes, None if its checksum is wrong."""
    if data[:4] == _TWO:
        is_right = len(data) >= 10 and crc_of(data[:-2]) == int.from_bytes(data[-2:], "little")
        return ServoPacket(2, data[4], data[7], _plain(data[8:-2])) if is_right else None
    is_right = ~sum(data[2:-1]) & 0xFF == data[-1]
    return ServoPacket(1, data[2], data[4], data[5:-1]) if is_right else None


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
        """Yield the replies to a packet, one after the other on the"""
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
        if packet.id == BROADCAST and packet.instruction in (SYNC_READ, FAST_SYNC_READ, BULK_READ, SYNC_WRITE):
            yield from self._of_group(packet, servos)
            return
        for servo in sorted(servos, key=lambda fake_servo: fake_servo.id):
            if packet.id in (servo.id, BROADCAST):
                answer = self._single(packet, servo)
                speaks = packet.id != BROADCAST or packet.instruction == PING
                level = servo.get("status_return_level") if "status_return_level" in servo.model.items else 2
                if speaks and level >= {PING: 0, READ: 1}.get(packet.instruction, 2):
                    yield servo, answer

    def _single(self, packet: ServoPacket, servo: FakeServo) -> bytes:
        given, protocol, own = packet.parameters, packet.protocol, servo.id
        wide = 2 if protocol == 2 else 1  # [B] of an address or a length
        if packet.instruction == PING:
            found = bytes(servo.memory[:2]) + b"\x2d" if protocol == 2 else b""  # model number and firmware
            return status(protocol, own, servo.alert, found)
        if packet.instruction == READ and len(given) >= 2 * wide:
            return self._read(servo, _number(given[:wide]), _number(given[wide : 2 * wide]))
        if packet.instruction == WRITE and len(given) > wide:
            result = servo.write(_number(given[:wide]), given[wide:])
            return status(protocol, own, servo.alert | result)
        if packet.instruction == REBOOT and protocol == 2:
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
        kind = packet.instruction, packet.protocol
        if packet.instruction == SYNC_WRITE:
            _write_all(given, packet.protocol, by_id)
        elif kind == (SYNC_READ, 2):
            asked = [by_id[one] for one in given[4:] if one in by_id]
            for servo in asked:
                yield servo, self._read(servo, _number(given[:2]), _number(given[2:4]))
        elif kind == (FAST_SYNC_READ, 2):
            asked = [by_id[one] for one in given[4:] if one in by_id]
            yield from _fast(asked, _number(given[:2]), _number(given[2:4]))
        elif kind == (BULK_READ, 2):
            for number, address, length in _triples_two(given):
                if number in by_id:
                    yield by_id[number], self._read(by_id[number], address, length)
        elif kind == (BULK_READ, 1):
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
    whole = b"\xff\xff\xfd\x00\xfe" + (len(asked) * (length + 4) + 1).to_bytes(2, "little") + bytes([STATUS])
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
    return packet_two(id, STATUS, data[8:-2])
