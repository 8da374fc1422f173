"""The SDK's packets of both protocols, one reply at a time: who answered, with which error byte and which data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import NamedTuple

from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, Protocol1PacketHandler, Protocol2PacketHandler

from rbxcompose.actuation.dynamixel_port import BlockingPort
from rbxcompose.actuation.groups import REPLY, ROOM
from rbxcompose.actuation.transfers import Stretch

_ALERT = 0x80  # bit of the error byte in 2.0 that tells of the servo, not of the request
_ONE_REFUSED = 2 | 8 | 16 | 64  # bits in 1.0 that tell of the request: limits, range, checksum, instruction
_FAST_HEAD, _FAST_ID = 8, 254  # [B] before the first part of a fast reply; the id under which it comes


class Answer(NamedTuple):
    """One reply."""

    id: int
    error: int
    data: bytes


class NoAnswer(Enum):
    """Why there is no reply."""

    SILENCE = "silence"
    CORRUPT = "corrupt"


class PacketsOne(Protocol1PacketHandler):  # type: ignore[misc]  # the SDK has no types
    """Protocol 1.0. It has no group read but that of MX servos, which read different stretches."""

    head, reply, group = b"\xff\xff", REPLY[1], ROOM[1]
    """How packets begin; the length of a reply without data, and of what fits into one request [B]."""

    def receive(self, port: BlockingPort) -> Answer | NoAnswer:
        """Return the next reply."""
        raw, result = self.rxPacket(port)
        if result != COMM_SUCCESS:
            return _no_answer(port, raw, result, self.head)
        return Answer(raw[2], raw[4], bytes(raw[5:-1]))

    def ask(self, port: BlockingPort, wanted: Mapping[int, Stretch]) -> bool:
        """Send one request for a stretch of each servo; return whether it was sent."""
        if len(wanted) == 1:
            [(servo, one)] = wanted.items()
            return bool(self.readTx(port, servo, one.address, one.length) == COMM_SUCCESS)
        given = [byte for servo, one in wanted.items() for byte in (one.length, servo, one.address)]
        return bool(self.bulkReadTx(port, given, len(given)) == COMM_SUCCESS)

    def write_group(self, port: BlockingPort, at: Stretch, data: Mapping[int, bytes]) -> bool:
        """Write the same stretch of several servos by one packet, which nobody answers."""
        given = [byte for servo, part in data.items() for byte in (servo, *part)]
        return bool(self.syncWriteTxOnly(port, at.address, at.length, given, len(given)) == COMM_SUCCESS)

    def is_refusal(self, error: int) -> bool:
        """Tell whether an error byte says that the request was not carried out."""
        return bool(error & _ONE_REFUSED)


class PacketsTwo(Protocol2PacketHandler):  # type: ignore[misc]  # the SDK has no types
    """Protocol 2.0."""

    head, reply, group = b"\xff\xff\xfd", REPLY[2], ROOM[2]
    """As in protocol 1.0."""

    def addStuffing(self, packet: list[int]) -> list[int]:  # noqa: N802
        """Mark what looks like the beginning of a packet; the SDK does that in a copy, which it does not send."""
        return _replaced(packet, b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")

    def removeStuffing(self, packet: list[int]) -> list[int]:  # noqa: N802
        """Remove these marks; the SDK loses bytes that follow a second one."""
        return _replaced(packet, b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")

    def receive(self, port: BlockingPort) -> Answer | NoAnswer:
        """Return the next reply."""
        raw, result = self.rxPacket(port, False)
        if result != COMM_SUCCESS:
            return _no_answer(port, raw, result, self.head)
        return Answer(raw[4], raw[8], bytes(raw[9:-2]))

    def receive_fast(self, port: BlockingPort, length: int) -> Iterator[Answer]:
        """Yield what is in the one packet that answers a fast request for `length` bytes, if it is whole."""
        raw, result = self.rxPacket(port, True)
        if result != COMM_SUCCESS or raw[4] != _FAST_ID:
            return
        for start in range(_FAST_HEAD, len(raw) - 1, length + 4):
            yield Answer(raw[start + 1], raw[start], bytes(raw[start + 2 : start + 2 + length]))

    def ask(self, port: BlockingPort, wanted: Mapping[int, Stretch], *, is_fast: bool = False) -> bool:
        """Send one request for a stretch of each servo; return whether it was sent."""
        first = next(iter(wanted.values()))
        if len(wanted) == 1 and not is_fast:
            return bool(self.readTx(port, next(iter(wanted)), first.address, first.length) == COMM_SUCCESS)
        if all(one == first for one in wanted.values()):
            ids = list(wanted)
            result = self.syncReadTx(port, first.address, first.length, ids, len(ids), is_fast)
            return bool(result == COMM_SUCCESS)
        given = [byte for servo, one in wanted.items() for byte in (servo, *_word(one.address), *_word(one.length))]
        return bool(self.bulkReadTx(port, given, len(given), False) == COMM_SUCCESS)

    def write_group(self, port: BlockingPort, at: Stretch, data: Mapping[int, bytes]) -> bool:
        """Write the same stretch of several servos by one packet, which nobody answers."""
        given = [byte for servo, part in data.items() for byte in (servo, *part)]
        return bool(self.syncWriteTxOnly(port, at.address, at.length, given, len(given)) == COMM_SUCCESS)

    def is_refusal(self, error: int) -> bool:
        """Tell whether an error byte says that the request was not carried out."""
        return bool(error & ~_ALERT)


Packets = PacketsOne | PacketsTwo


def packets_by_protocol() -> dict[int, Packets]:
    """Return the packets of both protocols, by the number of the protocol."""
    return {1: PacketsOne(), 2: PacketsTwo()}


def _no_answer(port: BlockingPort, raw: Sequence[int], result: int, head: bytes) -> NoAnswer:
    """Put back what may be a whole reply behind a broken one: a broken length takes in those that follow."""
    again = bytes(raw).find(head, 1)
    if again > 0:
        port.unread(raw[again:])
    return NoAnswer.SILENCE if result == COMM_RX_TIMEOUT else NoAnswer.CORRUPT


def _replaced(packet: list[int], old: bytes, new: bytes) -> list[int]:
    """Replace bytes between instruction and checksum of a packet, in place, and correct its length."""
    body = bytes(packet[7:-2])
    if old not in body:
        return packet
    body = body.replace(old, new)
    packet[7:-2] = body
    packet[5:7] = _word(len(body) + 2)
    return packet


def _word(number: int) -> tuple[int, int]:
    return number & 0xFF, number >> 8
