"""Packets of both Dynamixel protocols as servos see them: instructions are taken out of bytes, statuses are made.

Written from ROBOTIS's description of the protocols and independently of its SDK, which it tests.
"""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.dataclass import dataclass

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
