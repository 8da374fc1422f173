"""A board with inertial sensors."""

from __future__ import annotations

import math
import struct
from collections import Counter
from typing import Annotated, Any, Literal

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.config import BitRate
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Quaternion, Vector3, quaternion_from_rpy
from rbxcompose.domains.devices.nmea import ImpossibleSentenceError, Sentence, SentenceReader
from rbxcompose.domains.devices.serial_sensor import SerialConfig, SerialSensor
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs import geometry_msgs
from rbxcompose.msgs.sensor_msgs import Imu
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

GRAVITY = 9.80665  # [m/s^2], of what boards call 1 g
_START, _LENGTH = 0x55, 11
_ACCELERATION, _TURN_RATES, _ANGLES, _LAST = 0x51, 0x52, 0x53, 0x5F
_NUMBERS = struct.Struct("<4h")
_FULL = 32768.0
_SCALES = {_ACCELERATION: 16.0 * GRAVITY, _TURN_RATES: math.radians(2000.0), _ANGLES: math.pi}


@dataclass(frozen=True, slots=True)
class BoardReading:
    """What a board has measured: attitude, turn rates [rad/s], acceleration with that of gravity [m/s^2].

    x is ahead, y to the left and z up (REP 103).
    """

    orientation: Quaternion
    angular_velocity: Vector3
    acceleration: Vector3


class WitmotionDecoder:
    """Reads the packets of boards such as WT901, JY901 and HWT905.

    They have 11 bytes: 0x55, a type, four numbers of 16 bits with the lowest byte first, and the sum of these ten
    bytes; 0x51 is the acceleration, 0x52 are the turn rates, 0x53 the angles, after which a reading is whole.
    """

    def __init__(self, faults: Counter[str]) -> None:
        self._faults, self._rest = faults, bytearray()
        self._parts: dict[int, Vector3] = {}

    def forget(self) -> None:
        """Forget half a packet."""
        self._rest.clear()
        self._parts.clear()

    def feed(self, data: bytes) -> list[BoardReading]:
        """Return the readings that are whole now."""
        self._rest += data
        found, at = list[BoardReading](), 0
        while (start := self._rest.find(_START, at)) >= 0 and start + _LENGTH <= len(self._rest):
            packet = bytes(self._rest[start : start + _LENGTH])
            if not 0x50 <= packet[1] <= _LAST or sum(packet[:-1]) & 0xFF != packet[-1]:
                self._faults["wrong checksums"] += 1
                at = start + 1
                continue
            if start > at:
                self._faults["garbage"] += 1
            at = start + _LENGTH
            if (reading := self._part(packet)) is not None:
                found.append(reading)
        if start < 0 and at < len(self._rest):
            self._faults["garbage"] += 1
        del self._rest[: start if start >= 0 else len(self._rest)]
        return found

    def _part(self, packet: bytes) -> BoardReading | None:
        if (scale := _SCALES.get(packet[1])) is None:
            return None  # temperatures, magnetic fields, ports
        x, y, z, _ = _NUMBERS.unpack(packet[2:-1])
        self._parts[packet[1]] = (x / _FULL * scale, y / _FULL * scale, z / _FULL * scale)
        if packet[1] != _ANGLES or len(self._parts) < len(_SCALES):
            return None
        parts, self._parts = self._parts, {}
        return BoardReading(quaternion_from_rpy(*parts[_ANGLES]), parts[_TURN_RATES], parts[_ACCELERATION])


class VectornavDecoder:
    """Reads the sentences of boards such as VN-100, as they send them when they are new.

    The sentence `$VNYMR` has yaw, pitch and roll from north, east and down, and z down in the board.
    """

    def __init__(self, faults: Counter[str]) -> None:
        self._faults, self._sentences = faults, SentenceReader(faults)

    def forget(self) -> None:
        """Forget half a sentence."""
        self._sentences.forget()

    def feed(self, data: bytes) -> list[BoardReading]:
        """Return the readings that are whole now."""
        found = []
        for sentence in self._sentences.feed(data):
            if sentence.name == "VNYMR":
                try:
                    found.append(_reading(sentence))
                except ImpossibleSentenceError:
                    self._faults["impossible sentences"] += 1
        return found


def _reading(sentence: Sentence) -> BoardReading:
    values = [sentence.number(field) for field in range(12)]
    known = [value for value in values if value is not None]
    if len(known) < len(values):
        raise ImpossibleSentenceError(f"{sentence.name}: numbers are missing")
    yaw, pitch, roll = map(math.radians, known[:3])
    ax, ay, az, wx, wy, wz = known[6:]
    # From north, east, down to east, north, up; and from z down to z up in the board.
    return BoardReading(quaternion_from_rpy(roll, -pitch, math.pi / 2 - yaw), (wx, -wy, -wz), (ax, -ay, -az))


_DECODERS: dict[str, type[WitmotionDecoder | VectornavDecoder]] = {
    "witmotion": WitmotionDecoder,
    "vectornav": VectornavDecoder,
}


class ImuConfig(SerialConfig):
    """Which board."""

    protocol: Literal["witmotion", "vectornav"] = "witmotion"
    """What it speaks: packets as WT901 and its kin send them, or the sentence `$VNYMR` of VN-100 and its kin."""
    baud: Annotated[BitRate, Field(gt=0)] = 9600
    """Bits per second; 115200 for a new `vectornav`."""
    frame: str = "imu_link"
    """The frame of the board, as its axes are printed on it; for `vectornav` turned to x ahead and z up."""
    topic: TopicName = "imu"
    """Where it publishes."""


@sdk.component("imu")
class InertialBoard(SerialSensor[ImuConfig]):
    """Publishes what a board with inertial sensors measures: attitude, turn rates, acceleration with that of gravity.

    Example:
        imu: {type: imu, port: /dev/ttyUSB1, protocol: witmotion, baud: 115200, frame: imu_link}
    """

    what = "the board"
    rate = 100.0

    @classmethod
    def ports(cls, config: ImuConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with its topic."""
        return super().ports(config) | {"imu": sdk.Out(Imu, config.topic).named("imu")}

    def configure(self) -> None:
        """Build the decoder."""
        super().configure()
        self.decoder = _DECODERS[self.config.protocol](self.faults)

    def begin(self) -> None:
        """Forget half of what came before."""
        self.decoder.forget()

    def take(self, data: bytes) -> None:
        """Publish what is whole."""
        for reading in self.decoder.feed(data):
            self.understood()
            self.bound["imu"](
                Imu(
                    Header(stamp=to_time(self.stamp), frame_id=self.config.frame),
                    geometry_msgs.Quaternion(*reading.orientation),
                    np.zeros(9),  # of all zeros: not known
                    geometry_msgs.Vector3(*reading.angular_velocity),
                    np.zeros(9),
                    geometry_msgs.Vector3(*reading.acceleration),
                    np.zeros(9),
                )
            )
