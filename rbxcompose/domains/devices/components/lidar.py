"""A laser scanner at a serial port."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import Singles, np
from rbxcompose.base.config import BitRate
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.domains.devices.serial_sensor import SerialConfig, SerialSensor
from rbxcompose.manifest.fields import Farthest, TopicName
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

POINTS = 12  # of a packet
_HEAD = b"\x54\x2c"
_PACKET = struct.Struct(f"<2xHH{'HB' * POINTS}HHB")
LENGTH = _PACKET.size  # 47 [B]
_TURN = 36_000  # [0.01 deg]
_WIDEST = 3_000  # [0.01 deg] that a packet can span at any speed of the motor
_SLOWEST = 5.0  # [Hz] of turns; it is made for 10


def crc8(data: bytes) -> int:
    """Return the CRC of bytes."""
    crc = 0
    for byte in data:
        crc = _TABLE[crc ^ byte]
    return crc


def _entry(value: int) -> int:
    for _ in range(8):
        value = (value << 1) ^ (0x4D if value & 0x80 else 0)
    return value & 0xFF


_TABLE = tuple(map(_entry, range(256)))


@dataclass(frozen=True, slots=True)
class LidarPacket:
    """A packet whose checksum is right: speed [deg/s], angles [0.01 deg], distances [mm], strengths of echoes."""

    speed: int
    first: int
    last: int
    distances: tuple[int, ...]
    strengths: tuple[int, ...]


class LidarReader:
    """Finds the packets of the family LD06, LD19 and STL-19 in bytes that come in any pieces, and counts what is none.

    A packet is 0x54, 0x2C, the speed (u16) [deg/s], the first angle (u16) [0.01 deg], twelve times a distance (u16)
    [mm] and how strong the echo was (u8), the last angle (u16), a time (u16) [ms], and a CRC-8 (0x4D, from 0) of all
    before it. Numbers have the lowest byte first. Angles grow clockwise, seen from above; a distance of 0 is no echo.
    """

    def __init__(self, faults: Counter[str]) -> None:
        self._faults, self._rest = faults, bytearray()

    def forget(self) -> None:
        """Forget half a packet."""
        self._rest.clear()

    def feed(self, data: bytes) -> list[LidarPacket]:
        """Return the packets that are whole now."""
        self._rest += data
        found, at = list[LidarPacket](), 0
        while (start := self._rest.find(_HEAD, at)) >= 0 and start + LENGTH <= len(self._rest):
            if start > at:
                self._faults["cut packets"] += 1
            packet = bytes(self._rest[start : start + LENGTH])
            speed, first, *points, last, _, crc = _PACKET.unpack(packet)
            at = start + LENGTH
            if crc8(packet[:-1]) != crc:
                self._faults["wrong checksums"] += 1
                at = start + 1
            elif max(first, last) >= _TURN or (last - first) % _TURN > _WIDEST:
                self._faults["impossible packets"] += 1
            else:
                found.append(LidarPacket(speed, first, last, tuple(points[::2]), tuple(points[1::2])))
        if start < 0 and len(self._rest) - at > LENGTH:
            self._faults["garbage"] += 1
            at = len(self._rest) - 1  # the last byte may be the first of a packet
        del self._rest[: start if start >= 0 else at]
        return found


@dataclass(frozen=True, slots=True)
class WholeTurn:
    """A turn: distances [m] and strengths of echoes by angle, from -180 deg to 180 deg, and how long it took [s].

    Infinite is no echo, minus infinite one that is too near, and NaN where nothing was measured.
    """

    ranges: Singles
    strengths: Singles
    duration: float


class TurnMaker:
    """Makes turns of packets: `rays` rays, of which each has the nearest of what was measured in its direction."""

    def __init__(self, rays: int, nearest: float, farthest: float) -> None:
        self._rays, self._nearest, self._farthest = rays, nearest, farthest
        self.forget()

    def forget(self) -> None:
        """Begin with the next turn that is whole."""
        self._before: int | None = None
        self._is_whole = False
        self._clear()

    def _clear(self) -> None:
        self._ranges: Singles = np.full(self._rays, np.nan, np.float32)
        self._strengths: Singles = np.zeros(self._rays, np.float32)

    def add(self, packet: LidarPacket) -> Iterator[WholeTurn]:
        """Take a packet in, and yield the turn that it ends."""
        step = (packet.last - packet.first) % _TURN / (POINTS - 1)
        for number, (distance, strength) in enumerate(zip(packet.distances, packet.strengths, strict=True)):
            angle = (packet.first + number * step) % _TURN
            if self._before is not None and angle < self._before - _TURN / 2:
                if self._is_whole and packet.speed > 0:
                    yield WholeTurn(self._ranges, self._strengths, 360.0 / packet.speed)
                self._is_whole = True
                self._clear()
            self._before = int(angle)
            self._put(angle, distance / 1000.0, strength)

    def _put(self, angle: float, distance: float, strength: int) -> None:
        """Note what was measured: clockwise becomes counter-clockwise."""
        ray = round((0.5 - angle / _TURN) * self._rays) % self._rays
        if distance <= 0.0 or distance > self._farthest:
            distance = math.inf
        elif distance < self._nearest:
            distance = -math.inf
        known = self._ranges[ray]
        if np.isnan(known) or distance < known:
            self._ranges[ray], self._strengths[ray] = distance, strength


class LidarConfig(SerialConfig):
    """Which scanner, and what of its scans counts."""

    baud: Annotated[BitRate, Field(gt=0)] = 230400
    """Bits per second."""
    frame: str = "laser_link"
    """Its frame: x is ahead, where its angle is 0."""
    rays: Annotated[int, Field(ge=90, le=450)] = 360
    """Rays of a scan; it measures some 450 times a turn."""
    nearest: sdk.Length = Field(0.02, ge=0)
    """What is nearer is not measured."""
    farthest: Farthest = Field(12.0, gt=0, le=50, validate_default=True)
    """What is farther counts as no echo."""
    topic: TopicName = "scan"
    """Where scans are published."""


@sdk.component("lidar")
class Lidar(SerialSensor[LidarConfig]):
    """Publishes the scans of a laser scanner of the family LD06, LD19 and STL-19, as `laser_sim` does simulated ones.

    A ray without an echo is infinite; where a packet was lost, it is NaN. The stamp is that of the middle of a turn.

    Example:
        lidar: {type: lidar, port: /dev/ttyUSB0, frame: laser_link}
    """

    what = "the scanner"

    @classmethod
    def ports(cls, config: LidarConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the scans."""
        return super().ports(config) | {"scan": sdk.Out(LaserScan, config.topic, rate=_SLOWEST).named("scan")}

    def configure(self) -> None:
        """Have no scan yet."""
        super().configure()
        config = self.config
        self.packets = LidarReader(self.faults)
        self.turns = TurnMaker(config.rays, config.nearest, config.farthest)
        self.duration = 0.0  # [s] of the last turn

    def begin(self) -> None:
        """Begin with the next whole turn."""
        self.packets.forget()
        self.turns.forget()

    def take(self, data: bytes) -> None:
        """Publish the turns that are whole."""
        for packet in self.packets.feed(data):
            self.understood()
            for turn in self.turns.add(packet):
                self.duration = turn.duration
                self.publish(turn)

    def publish(self, turn: WholeTurn) -> None:
        """Publish a turn."""
        config, step = self.config, math.tau / self.config.rays
        stamp = self.stamp - round(turn.duration / 2 * 1e9)
        self.bound["scan"](
            LaserScan(
                header=Header(stamp=to_time(max(stamp, 0)), frame_id=config.frame),
                angle_min=-math.pi,
                angle_max=math.pi - step,
                angle_increment=step,
                scan_time=turn.duration,
                range_min=config.nearest,
                range_max=config.farthest,
                ranges=turn.ranges,
                intensities=turn.strengths,
            )
        )

    def state(self) -> tuple[Level, str]:
        """Return how fast it turns."""
        if not self.duration:
            return Level.WARN, "no whole turn yet"
        turns = 1.0 / self.duration
        return Level.OK if turns >= _SLOWEST else Level.WARN, f"{turns:.0f} turns a second"
