"""The serial port under the SDK's packets of both protocols: reads wait in the kernel until a deadline."""

from __future__ import annotations

import os
import select
import termios
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from typing import NamedTuple

from dynamixel_sdk import (
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    INST_PING,
    PortHandler,
    Protocol1PacketHandler,
    Protocol2PacketHandler,
)

from rbxcompose.domains.devices import serial_ports
from rbxcompose.domains.servos.bus import REPLY, ROOM
from rbxcompose.domains.servos.transfers import Stretch

BITS = 10  # of a byte on the wire: start bit, eight of data, stop bit
_CHUNK = 4096  # [B] of one read
_EARLY = 0.0005  # [s] before the last byte of long replies at which it is worth looking
_STUCK = 0.5  # [s] after which a port that takes no bytes has failed to send


class BlockingPort(PortHandler):  # type: ignore[misc]  # the SDK has no types
    """A serial port at `baud` [bit/s] whose packets may be `timeout` [s] later than the wire needs.

    With `has_echo` the adapter returns what it sends, which is dropped.

    Raises:
        PortError: when made, if the port cannot be opened; at any later use, if it has gone.
    """

    def __init__(
        self, path: str, baud: int, *, timeout: float = 0.002, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(path)
        self.is_open: bool = False
        self.timeout, self.has_echo = timeout, False
        self.reply_delay = 0.0  # [s] for which servos pause before a reply
        self._clock = clock
        self._buffer, self._own = bytearray(), bytearray()  # received; sent and not echoed yet
        self._sent = 0.0  # [s], when the last packet will have left the wire
        self._deadline, self._has_looked = 0.0, True
        self._nap = 0.0  # [s] before it is worth looking
        self.setBaudRate(baud)

    def setBaudRate(self, baudrate: int) -> bool:  # noqa: N802
        """Open the port at any rate [bit/s] that the adapter has."""
        self.baudrate = baudrate
        self._open()
        return True

    def openPort(self) -> bool:  # noqa: N802
        """Open the port again."""
        return self.setBaudRate(self.baudrate)

    def _open(self) -> None:
        if self.is_open:
            self.closePort()
        self.ser = serial_ports.opened(str(self.port_name), self.baudrate)
        self._descriptor = self.ser.fileno()
        self.is_open, self.is_using = True, False
        self.tx_time_per_byte = 1000.0 * BITS / self.baudrate
        try:
            self.clearPort()
        except serial_ports.PortError:
            self.closePort()
            raise

    def closePort(self) -> None:  # noqa: N802
        """Close it; a port that is closed stays so."""
        if self.is_open:
            self.is_open = False
            self.ser.close()

    def clearPort(self) -> None:  # noqa: N802
        """Forget what has been received."""
        self._buffer.clear()
        self._own.clear()
        try:
            termios.tcflush(self._descriptor, termios.TCIFLUSH)
        except termios.error as error:
            raise self._lost() from error

    def getBytesAvailable(self) -> int:  # noqa: N802
        """Return how much has been received and not been read yet [B]."""
        self._fill(0.0)
        return len(self._buffer)

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return just `length` bytes, or those that have come until the deadline."""
        if self._nap > 0 and len(self._buffer) < length:
            # The wire cannot be faster: one nap costs less than waking up for each piece of the replies.
            time.sleep(self._nap)
            self._nap = 0.0
        while len(self._buffer) < length:
            left = self._deadline - self._clock()
            # Once, what has come while this process had no processor still counts; a babbling bus must not hold it.
            if left <= 0 and self._has_looked:
                break
            self._has_looked = left <= 0
            self._fill(max(left, 0.0))
        taken = bytes(self._buffer[: max(length, 0)])
        del self._buffer[: len(taken)]
        return taken

    def unread(self, data: Sequence[int]) -> None:
        """Put bytes back, so that they are read again."""
        self._buffer[:0] = bytes(data)

    def _fill(self, patience: float) -> None:
        """Wait for bytes for at most `patience` [s]."""
        try:
            if not select.select([self._descriptor], [], [], patience)[0]:
                return
            data = os.read(self._descriptor, _CHUNK)
        except (OSError, ValueError) as error:
            raise self._lost() from error
        if not data:
            raise self._lost()
        echoed = min(len(self._own), len(data))
        del self._own[:echoed]
        self._buffer += data[echoed:]

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        """Send bytes and return how many were sent; fewer if the port is stuck."""
        data, sent = bytes(packet), 0
        while sent < len(data):
            try:
                sent += os.write(self._descriptor, data[sent:])
            except BlockingIOError:
                if not select.select([], [self._descriptor], [], _STUCK)[1]:
                    break
            except (OSError, ValueError) as error:
                raise self._lost() from error
        self._sent = max(self._sent, self._clock()) + BITS * sent / self.baudrate
        if self.has_echo:
            self._own += data[:sent]
        return sent

    def wait_for(self, length: int, replies: int = 1) -> None:
        """Set the deadline of `replies` with together `length` bytes, which follow what was sent last."""
        now = self._clock()
        carried = max(self._sent, now) + BITS * length / self.baudrate
        self._wait_until(carried + replies * self.reply_delay + self.timeout)
        self._nap = carried - now - _EARLY

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        """Set the deadline of a packet of this length [B]."""
        self.wait_for(packet_length)

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        """Set the deadline to this long from now [ms]."""
        self._wait_until(self._clock() + msec / 1000)

    def _wait_until(self, deadline: float) -> None:
        self._deadline, self._has_looked, self._nap = deadline, False, 0.0

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Tell whether the deadline has passed."""
        return self._clock() >= self._deadline and self._has_looked

    def getCurrentTime(self) -> float:  # noqa: N802
        """Return monotonic time [ms]."""
        return 1000 * self._clock()

    def _lost(self) -> serial_ports.LostPortError:
        return serial_ports.LostPortError(str(self.port_name), "has gone")


_ALERT = 0x80  # bit of the error byte in 2.0 that is about the servo, not of the request
_ONE_REFUSED = 2 | 8 | 16 | 64  # bits in 1.0 that are about the request: limits, range, checksum, instruction
_FAST_HEAD, _FAST_ID = 8, 254  # [B] before the first part of a fast reply; the id under which it comes


MODEL = Stretch(0, 2)  # where all tables have the model's number


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

    head, reply, group, greeting = b"\xff\xff", REPLY[1], ROOM[1], MODEL.length
    """How packets begin; the lengths of a reply without data, of what fits into one request, and of the model [B]."""

    def receive(self, port: BlockingPort) -> Answer | NoAnswer:
        """Return the next reply."""
        raw, result = self.rxPacket(port)
        if result != COMM_SUCCESS:
            return _no_answer(port, raw, result, self.head)
        return Answer(raw[2], raw[4], bytes(raw[5:-1]))

    def ask_model(self, port: BlockingPort, id: int) -> None:
        """Ask a servo for its model, which its reply to a ping does not have."""
        self.ask(port, {id: MODEL})

    def ask(self, port: BlockingPort, wanted: Mapping[int, Stretch]) -> bool:
        """Send one request for a stretch of each servo; return whether it was sent."""
        if len(wanted) == 1:
            [(servo, stretch)] = wanted.items()
            return bool(self.readTx(port, servo, stretch.address, stretch.length) == COMM_SUCCESS)
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

    head, reply, group, greeting = b"\xff\xff\xfd", REPLY[2], ROOM[2], MODEL.length + 1
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

    def ask_model(self, port: BlockingPort, id: int) -> None:
        """Ask a servo for its model and firmware, also one that answers nothing but this."""
        self.txPacket(port, [0, 0, 0, 0, id, 3, 0, INST_PING, 0, 0])
        port.wait_for(self.reply + self.greeting)

    def ask(self, port: BlockingPort, wanted: Mapping[int, Stretch], *, is_fast: bool = False) -> bool:
        """Send one request for a stretch of each servo; return whether it was sent."""
        first = next(iter(wanted.values()))
        if len(wanted) == 1 and not is_fast:
            return bool(self.readTx(port, next(iter(wanted)), first.address, first.length) == COMM_SUCCESS)
        if all(stretch == first for stretch in wanted.values()):
            ids = list(wanted)
            result = self.syncReadTx(port, first.address, first.length, ids, len(ids), is_fast)
            return bool(result == COMM_SUCCESS)
        given = [byte for servo, item in wanted.items() for byte in (servo, *_word(item.address), *_word(item.length))]
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
