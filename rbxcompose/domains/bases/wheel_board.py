"""The protocol of a board with two motors and encoders, such as an Arduino; `sketch/wheel_board` is the other end.

A frame is 0x7E, the length of its payload, a number that counts up, a type, the payload, and a CRC-16 (CCITT: 0x1021,
from 0xFFFF) of all but the first byte and itself. Numbers have the lowest byte first.

| type | from | payload |
| --- | --- | --- |
| 0x01 hello | host | version (u8) |
| 0x02 drive | host | speeds of the left and the right wheel (i16 each) [ticks/s] |
| 0x81 hello | board | version (u8), silence after which it stops its motors (u16) [ms] |
| 0x82 state | board | positions of the left and the right wheel (i32 each) [ticks], battery (u16) [mV], flags (u8) |

Both ends repeat theirs, which is the heartbeat: the host `drive` 50 times a second, the board `state`, also before it
was greeted. So the host listens first and greets then: a board that has started meanwhile says that it was not greeted.
The board drives only after a hello of its own version, and stops its motors when no `drive` has come for its silence.
Flags: 1 it was greeted, 2 a motor has failed, 4 it stands because of silence.

A board turns its motors off when one has failed. With the sketch that is so until the host wants both wheels to rest,
if a wheel has stood at full power for 0.3 s, and until the board starts again, if one has turned against its power for
0.3 s without slowing down.
"""

from __future__ import annotations

import math
import struct
from binascii import crc_hqx
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.bases.wheels import WheelSpeeds

VERSION = 1
HELLO, DRIVE, BOARD_HELLO, BOARD_STATE = 0x01, 0x02, 0x81, 0x82
GREETED, FAILED, STANDS = 1, 2, 4
MOST_TICKS = 32767  # [ticks/s] of a wheel that can be said
COUNTS = 2**32  # after so many ticks a position begins again
SILENT = 0.2  # [s] without a state, after which the link is down
_START, _LONGEST, _FROM = 0x7E, 32, 0xFFFF
_HEAD, _CRC = 4, 2  # [B]
_GREET = 0.2  # [s] between two hellos
_UNHEARD = 3.0  # [s] after which a board is greeted that nothing was heard of: its bootloader takes less
_DRIVE, _STATE, _HELLO = struct.Struct("<hh"), struct.Struct("<iiHB"), struct.Struct("<BH")


class BoardFrame(NamedTuple):
    """A frame whose checksum is right."""

    type: int
    number: int
    payload: bytes


def frame(type_: int, number: int, payload: bytes) -> bytes:
    """Return a frame as bytes."""
    body = bytes([len(payload), number & 0xFF, type_]) + payload
    return bytes([_START]) + body + crc_hqx(body, _FROM).to_bytes(2, "little")


class FrameReader:
    """Finds frames in bytes that come in any pieces, and counts what is none."""

    def __init__(self, faults: Counter[str]) -> None:
        self._faults, self._rest = faults, bytearray()

    def forget(self) -> None:
        """Forget half a frame."""
        self._rest.clear()

    def feed(self, data: bytes) -> list[BoardFrame]:
        """Return the frames that are whole now."""
        self._rest += data
        found, at = list[BoardFrame](), 0
        while (start := self._rest.find(_START, at)) >= 0:
            if start > at:
                self._faults["garbage"] += 1
            at = start
            if len(self._rest) < at + _HEAD:
                break
            end = at + _HEAD + self._rest[at + 1]
            if self._rest[at + 1] <= _LONGEST and len(self._rest) < end + _CRC:
                break
            body, crc = bytes(self._rest[at + 1 : end]), bytes(self._rest[end : end + _CRC])
            if len(body) > _LONGEST + _HEAD or crc_hqx(body, _FROM) != int.from_bytes(crc, "little"):
                self._faults["wrong checksums"] += 1
                at += 1
                continue
            found.append(BoardFrame(body[2], body[1], body[3:]))
            at = end + _CRC
        if start < 0 and at < len(self._rest):
            self._faults["garbage"] += 1
        del self._rest[: at if start >= 0 else len(self._rest)]
        return found


@dataclass(frozen=True, slots=True)
class BoardState:
    """What a board says: positions of its wheels [ticks], its battery [V], and what its flags mean.

    With `begins`, it has started since the last state, so that its wheels count from elsewhere.
    """

    left: int
    right: int
    voltage: float
    has_failed: bool
    stands: bool
    begins: bool


class BoardLink:
    """The host's end: greets until the board answers, then drives; a board that starts again is greeted again."""

    def __init__(self, faults: Counter[str]) -> None:
        self._faults, self._frames = faults, FrameReader(faults)
        self.version: int | None = None  # of the board
        self.is_greeted = False
        self._heard_at = self._greeted_at = -math.inf
        self._waits_until: float | None = None  # for the first state, before it greets
        self._number = 0
        self._begins = False
        self._next: int | None = None  # number of the next frame of the board

    def forget(self) -> None:
        """Start over: the port was opened, or the board was silent."""
        self._frames.forget()
        self.version, self.is_greeted, self._next, self._waits_until = None, False, None, None
        self._heard_at = self._greeted_at = -math.inf

    @property
    def is_of_another_version(self) -> bool:
        """Return whether the board speaks another version of the protocol, so that it must not be driven."""
        return self.version not in (None, VERSION)

    def is_alive(self, now: float) -> bool:
        """Return whether the board was greeted and is heard."""
        return self.is_greeted and now - self._heard_at <= SILENT

    def feed(self, data: bytes, now: float) -> Iterator[BoardState]:
        """Yield the states that have come."""
        for found in self._frames.feed(data):
            if self._next not in (None, found.number):
                self._faults["lost frames"] += (found.number - (self._next or 0)) & 0xFF
            self._next = (found.number + 1) & 0xFF
            match found.type, len(found.payload):
                case 0x81, _HELLO.size:
                    self.version, _ = _HELLO.unpack(found.payload)
                case 0x82, _STATE.size:
                    left, right, millivolts, flags = _STATE.unpack(found.payload)
                    self._heard_at = now
                    self._begins |= not flags & GREETED
                    self.is_greeted = bool(flags & GREETED) and self.version == VERSION
                    if self.is_greeted:
                        begins, self._begins = self._begins, False
                        failed, stands = bool(flags & FAILED), bool(flags & STANDS)
                        yield BoardState(left, right, millivolts / 1000.0, failed, stands, begins)
                case _:
                    self._faults["unknown frames"] += 1

    def speak(self, now: float, speeds: WheelSpeeds) -> bytes:
        """Return what to send now: speeds of the wheels [ticks/s], and a hello until the board was greeted."""
        said = b""
        if self._waits_until is None:
            self._waits_until = now + _UNHEARD
        may_greet = self._heard_at > -math.inf or now >= self._waits_until
        if not self.is_greeted and may_greet and now - self._greeted_at >= _GREET - 1e-6:
            self._greeted_at = now
            said += self._frame(HELLO, bytes([VERSION]))
        if self.is_greeted:
            said += self._frame(DRIVE, _DRIVE.pack(_ticks(speeds.left), _ticks(speeds.right)))
        return said

    def _frame(self, type_: int, payload: bytes) -> bytes:
        self._number = (self._number + 1) & 0xFF
        return frame(type_, self._number, payload)


def _ticks(speed: float) -> int:
    return max(-MOST_TICKS, min(MOST_TICKS, round(speed)))
