"""A laser scanner at a pseudo-terminal, byte by byte as its manual has it."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.devices.components.lidar import LENGTH, LidarReader, TurnMaker, crc8
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.testing import Bench, instance
from tests.devices.plugged import PluggedDevice, plugged_in

# The example of the manual of the LD06.
MANUAL = bytes.fromhex("542c6808ab7ee000e4dc00e2d900e5d500e3d300e4d000e9cd00e4ca00e2c700e9c500e5c200e5c000e5be823a1a50")
PACKETS = 38  # of a turn
Wall = Callable[[float], float]  # how far it is [m], by the angle clockwise [deg]


def packet(first: float, last: float, wall: Wall, speed: int = 3600) -> bytes:
    angles = [first + (last - first) * number / 11 for number in range(12)]
    points = b"".join(struct.pack("<HB", round(1000 * wall(angle % 360)), 200) for angle in angles)
    ends = [round(angle % 360 * 100) % 36000 for angle in (first, last)]
    body = b"\x54\x2c" + struct.pack("<HH", speed, ends[0]) + points + struct.pack("<HH", ends[1], 0)
    return body + bytes([crc8(body)])


def turn(wall: Wall, speed: int = 3600) -> list[bytes]:
    width = 360 / PACKETS
    return [packet(width * number, width * (number + 11 / 12), wall, speed) for number in range(PACKETS)]


def room(angle: float) -> float:
    """Two metres everywhere, one metre to the right, nothing behind."""
    return 1.0 if 80 <= angle <= 100 else 0.0 if 170 <= angle <= 190 else 2.0


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PluggedDevice]:
    with plugged_in(tmp_path / "port") as found:
        yield found


class Scanned:
    """A scanner of a robot on the bench."""

    def __init__(self, device: PluggedDevice, **config: object) -> None:
        self.device = device
        self.bench = Bench(instance("lidar", "lidar", {"port": str(device.path), **config}))
        self.scans = self.bench.collect("scan", LaserScan)
        self.statuses: list[DiagnosticStatus] = self.bench.statuses("lidar")
        self.bench.advance(0.1)

    def hears(self, *turns: list[bytes]) -> None:
        for packets in turns:
            self.device.write(b"".join(packets))
            self.bench.advance(0.1)

    def at(self, degrees: float) -> float:
        """Return what the last scan has in a direction, counter-clockwise as everywhere."""
        scan = self.scans[-1]
        ray = round((math.radians(degrees) - scan.angle_min) / scan.angle_increment) % len(scan.ranges)
        return float(scan.ranges[ray])


def test_the_packet_of_the_manual_is_read() -> None:
    (found,) = LidarReader(Counter()).feed(MANUAL)
    assert (found.speed, found.first, found.last) == (2152, 32427, 33470)
    assert found.distances[:2] == (224, 220)
    assert found.strengths[:2] == (228, 226)


def test_a_turn_becomes_a_scan_that_is_counter_clockwise(device: PluggedDevice) -> None:
    robot = Scanned(device)
    robot.hears(turn(room), turn(room), turn(room))
    assert len(robot.scans) == 1  # the first turn may have begun anywhere
    scan = robot.scans[0]
    assert (len(scan.ranges), scan.header.frame_id) == (360, "laser_link")
    assert scan.scan_time == pytest.approx(0.1)
    assert robot.at(0) == robot.at(90) == pytest.approx(2.0)
    assert robot.at(-90) == pytest.approx(1.0)
    assert robot.at(180) == math.inf
    assert not np.isnan(scan.ranges).any()


def test_what_is_too_near_and_too_far_is_marked(device: PluggedDevice) -> None:
    robot = Scanned(device, nearest="30 cm", farthest="5 m")
    near = turn(lambda angle: 0.2 if angle < 90 else 6.0 if angle < 180 else 3.0)
    robot.hears(near, near, near)
    assert [robot.at(-45), robot.at(-135)] == [-math.inf, math.inf]
    assert robot.at(90) == pytest.approx(3.0)


def test_half_packets_and_wrong_checksums_are_counted_and_leave_gaps_that_are_no_free_way(
    device: PluggedDevice,
) -> None:
    robot = Scanned(device)
    broken = turn(room)
    broken[5] = broken[5][:-1] + bytes([broken[5][-1] ^ 1])
    broken[9] = broken[9][:20]
    robot.hears(turn(room), broken, turn(room), turn(room))
    gaps = np.isnan(robot.scans[0].ranges).sum()
    assert 12 <= gaps <= 30
    assert not np.isinf(robot.scans[0].ranges).sum() > 25  # only what was behind
    robot.bench.advance(1.6)
    values = {value.key: value.value for value in robot.statuses[-1].values}
    assert values.keys() >= {"wrong checksums", "cut packets"}
    assert robot.statuses[-1].message == "10 turns a second; some of what comes cannot be read"


def test_a_scanner_that_turns_slowly_is_a_warning(device: PluggedDevice) -> None:
    robot = Scanned(device)
    for _ in range(6):
        robot.hears(turn(room, speed=1080))
        robot.bench.advance(0.3)
    assert (robot.statuses[-1].level, robot.statuses[-1].message) == (1, "3 turns a second")


def test_an_unplugged_scanner_publishes_nothing_and_is_read_again(device: PluggedDevice) -> None:
    robot = Scanned(device)
    robot.hears(turn(room), turn(room), turn(room))
    device.unplug()
    robot.bench.advance(2.0)
    assert robot.statuses[-1].level == 2
    device.plug()
    robot.bench.advance(1.5)
    robot.hears(turn(room), turn(room), turn(room))
    assert len(robot.scans) == 2


@given(st.binary(max_size=300), st.integers(1, 60))
def test_no_bytes_make_the_reader_fail_and_it_finds_the_next_packets(data: bytes, size: int) -> None:
    mixed = data + MANUAL * 3
    reader = LidarReader(Counter())
    found = [each for at in range(0, len(mixed), size) for each in reader.feed(mixed[at : at + size])]
    assert found[-1].first == 32427


@given(st.lists(st.binary(min_size=LENGTH - 3, max_size=LENGTH - 3), max_size=50))
def test_whatever_packets_say_ranges_are_within_the_limits(bodies: list[bytes]) -> None:
    maker, reader = TurnMaker(360, 0.1, 12.0), LidarReader(Counter())
    for body in bodies:
        data = b"\x54\x2c" + body
        for found in reader.feed(data + bytes([crc8(data)])):
            for whole in maker.add(found):
                known = whole.ranges[np.isfinite(whole.ranges)]
                assert ((known >= 0.1) & (known <= 12.0)).all()
