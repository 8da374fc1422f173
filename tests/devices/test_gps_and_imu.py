"""Receivers and boards at a pseudo-terminal: what they say right is published, and what they say wrong is counted."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import rotate
from rbxcompose.domains.devices.components.imu import GRAVITY, VectornavDecoder, WitmotionDecoder
from rbxcompose.domains.devices.nmea import (
    GroundVelocity,
    ImpossibleSentenceError,
    SatelliteFix,
    SatelliteReceiver,
    Sentence,
    SentenceReader,
    checksum,
)
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.msgs.geometry_msgs import TwistStamped
from rbxcompose.msgs.sensor_msgs import Imu, NavSatFix, NavSatStatus
from rbxcompose.testing import Bench, instance
from tests.devices.plugged import PluggedDevice, plugged_in


def framed(body: str) -> bytes:
    """Return a whole sentence."""
    return f"${body}*{checksum(body.encode('ascii')):02X}\r\n".encode("ascii")


GGA = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"  # as in the manuals
RMC = b"$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\r\n"
LOST = framed("GPGGA,123520,,,,,0,00,99.9,,M,,M,,")
LEVEL = (b"\0", b"\1", b"\2")


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PluggedDevice]:
    with plugged_in(tmp_path / "port") as found:
        yield found


class Sensed:
    """A sensor of a robot on the bench, at a pseudo-terminal."""

    def __init__(self, type_name: str, device: PluggedDevice, topics: dict[str, Any], **config: object) -> None:
        self.device = device
        self.bench = Bench(instance("sensor", type_name, {"port": str(device.path), **config}))
        self.found = {topic: self.bench.collect(topic, message) for topic, message in topics.items()}
        self.statuses: list[DiagnosticStatus] = self.bench.statuses("sensor")
        self.bench.advance(0.1)

    def hears(self, data: bytes, seconds: float = 0.1) -> None:
        self.device.write(data)
        self.bench.advance(seconds)

    def status(self, seconds: float = 1.9) -> tuple[int, str]:
        self.bench.advance(seconds)
        last = self.statuses[-1]
        return last.level, last.message

    @property
    def values(self) -> dict[str, str]:
        return {value.key: value.value for value in self.statuses[-1].values}


def gps(device: PluggedDevice) -> Sensed:
    return Sensed("gps", device, {"fix": NavSatFix, "vel": TwistStamped})


def test_a_fix_and_a_velocity_are_published(device: PluggedDevice) -> None:
    robot = gps(device)
    robot.hears(GGA + RMC)
    (fix,), (velocity,) = robot.found["fix"], robot.found["vel"]
    assert (fix.status.status, fix.status.service) == (NavSatStatus.STATUS_FIX, NavSatStatus.SERVICE_GPS)
    assert fix.latitude == pytest.approx(48 + 7.038 / 60)
    assert fix.longitude == pytest.approx(11 + 31 / 60)
    assert fix.altitude == pytest.approx(545.4 + 46.9)
    assert fix.position_covariance[0] == pytest.approx((4.0 * 0.9) ** 2)
    speed = 22.4 * 1852 / 3600
    assert velocity.twist.linear.x == pytest.approx(speed * math.sin(math.radians(84.4)))
    assert velocity.twist.linear.y == pytest.approx(speed * math.cos(math.radians(84.4)))
    assert robot.status() == (0, "a fix by 8 satellites")


def test_without_a_fix_there_is_no_place_and_a_warning(device: PluggedDevice) -> None:
    robot = gps(device)
    robot.hears(GGA + LOST)
    fix = robot.found["fix"][-1]
    assert fix.status.status == NavSatStatus.STATUS_NO_FIX
    assert all(map(math.isnan, (fix.latitude, fix.longitude, fix.altitude)))
    assert robot.status() == (1, "NO_FIX: the receiver does not know where it is")


@pytest.mark.parametrize("quality", [0, 6, 7, 8], ids=["none", "estimated", "entered", "simulated"])
def test_a_place_that_no_satellite_vouches_for_is_none(quality: int) -> None:
    found = SatelliteReceiver().take(
        Sentence("GPGGA", ("1", "4807.038", "N", "01131.000", "E", str(quality), "8", "1", "5", "M", "4", "M"))
    )
    assert isinstance(found, SatelliteFix)
    assert not found.is_fix
    assert math.isnan(found.latitude)


def test_a_receiver_whose_rmc_or_gsa_says_no_has_no_fix() -> None:
    for sentence in (Sentence("GPRMC", ("1", "V")), Sentence("GNGSA", ("A", "1"))):
        receiver = SatelliteReceiver()
        receiver.take(sentence)
        (gga,) = SentenceReader(Counter()).feed(GGA)
        found = receiver.take(gga)
        assert isinstance(found, SatelliteFix)
        assert not found.is_fix


@pytest.mark.parametrize("modes", [("3", "1"), ("1", "3"), ("1", "1")])
def test_one_system_without_a_fix_vetoes_none_of_the_others(modes: tuple[str, ...]) -> None:
    receiver = SatelliteReceiver()
    (gga,) = SentenceReader(Counter()).feed(GGA)
    fixes: list[Any] = []
    for _ in range(2):
        for talker, mode in zip(("GP", "BD"), modes, strict=True):
            dops = ("2.5", "1.3", "2.0") if mode == "3" else ("99.9",) * 3
            receiver.take(Sentence(f"{talker}GSA", ("A", mode, *[""] * 12, *dops)))
        fixes.append(receiver.take(gga))
    has_fix = "3" in modes
    assert [found.is_fix for found in fixes] == [has_fix] * 2
    assert not has_fix or [found.vertical_variance for found in fixes] == [pytest.approx(8.0**2)] * 2


def test_a_fix_that_all_systems_have_lost_is_none() -> None:
    receiver = SatelliteReceiver()
    (gga,) = SentenceReader(Counter()).feed(GGA)
    for mode, is_fix in (("3", True), ("1", False), ("2", True)):
        receiver.take(Sentence("GPGSA", ("A", mode)))
        receiver.take(Sentence("GLGSA", ("A", "1")))
        found = receiver.take(gga)
        assert isinstance(found, SatelliteFix)
        assert found.is_fix is is_fix


def test_vtg_gives_the_velocity_where_no_rmc_comes() -> None:
    receiver, vtg = SatelliteReceiver(), Sentence("GPVTG", ("90.0", "T", "", "M", "10.0", "N", "18.52", "K", "A"))
    found = receiver.take(vtg)
    assert isinstance(found, GroundVelocity)
    assert (found.east, found.north) == pytest.approx((10 * 1852 / 3600, 0.0), abs=1e-9)
    (rmc,) = SentenceReader(Counter()).feed(RMC)
    receiver.take(rmc)
    assert receiver.take(vtg) is None


def test_garbage_half_sentences_and_wrong_checksums_are_counted(device: PluggedDevice) -> None:
    robot = gps(device)
    robot.hears(b"\xff\x00hello\r\n" + GGA[:30] + GGA + GGA.replace(b"8,0.9", b"7,0.9") + GGA)
    assert len(robot.found["fix"]) == 2
    level, words = robot.status()
    assert (level, words) == (1, "a fix by 8 satellites; some of what comes cannot be read")
    assert robot.values.items() >= {"garbage": "1", "half sentences": "1", "wrong checksums": "1"}.items()


@pytest.mark.parametrize(
    "body",
    [
        "GPGGA,1,9107.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,1,4867.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,1,4807.038,Q,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,1,,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,1,nan,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
    ],
    ids=["beyond the pole", "67 minutes", "no direction", "empty", "not a number"],
)
def test_what_cannot_be_is_no_fix_though_its_checksum_is_right(device: PluggedDevice, body: str) -> None:
    robot = gps(device)
    robot.hears(framed(body))
    assert robot.found["fix"] == []
    robot.status()
    assert robot.values["impossible sentences"] == "1"


def test_a_wrong_baud_rate_is_guessed_from_bytes_that_nobody_can_read(device: PluggedDevice) -> None:
    robot = gps(device)
    for _ in range(5):
        robot.hears(b"\x80\xf8\x00\x78" * 50, 1.0)
    expected = "nothing that the receiver sends can be read: does it really send at 9600 bit/s?"
    assert robot.status(0.0) == (2, expected)


def test_an_unplugged_receiver_is_reported_and_read_again_when_it_is_back(device: PluggedDevice) -> None:
    robot = gps(device)
    robot.hears(GGA)
    device.unplug()
    assert robot.status() == (2, f"{device.path} does not exist; it is tried again")
    device.plug()
    robot.bench.advance(1.5)
    robot.hears(GGA)
    assert robot.status()[0] == 0
    assert len(robot.found["fix"]) == 2
    assert any("the receiver is back" in text for text in robot.bench.texts())


def test_a_silent_receiver_is_an_error(device: PluggedDevice) -> None:
    robot = gps(device)
    robot.hears(GGA)
    assert robot.status(5.0) == (2, "the receiver is silent")


@given(st.binary(max_size=400), st.integers(1, 50))
def test_no_bytes_make_the_reader_fail_and_pieces_do_not_matter(data: bytes, size: int) -> None:
    whole, pieces = SentenceReader(Counter()), SentenceReader(Counter())
    mixed = data.replace(b"\n", b" ") + b"\n" + GGA + data[:20]
    one = whole.feed(mixed)
    parts = [mixed[at : at + size] for at in range(0, len(mixed), size)]
    assert [sentence for part in parts for sentence in pieces.feed(part)] == one
    assert one[-1].name == "GPGGA"


@given(st.lists(st.text("0123456789.,-NSEWA", max_size=8), max_size=20), st.sampled_from(["GGA", "RMC", "GSA", "VTG"]))
def test_whatever_a_sentence_says_a_place_is_on_earth(fields: Sequence[str], kind: str) -> None:
    try:
        found = SatelliteReceiver().take(Sentence(f"GP{kind}", tuple(fields)))
    except ImpossibleSentenceError:
        return
    if isinstance(found, SatelliteFix) and found.is_fix:
        assert abs(found.latitude) <= 90.0
        assert abs(found.longitude) <= 180.0


def packet(kind: int, *values: int) -> bytes:
    body = struct.pack("<BB4h", 0x55, kind, *values, *[0] * (4 - len(values)))
    return body + bytes([sum(body) & 0xFF])


STILL = packet(0x51, 0, 0, 2048) + packet(0x52, 0, 0, 16384) + packet(0x53, 0, 0, 16384)  # 1 g, 1000 deg/s, 90 deg


def test_a_witmotion_board_is_published(device: PluggedDevice) -> None:
    robot = Sensed("imu", device, {"imu": Imu})
    robot.hears(STILL)
    (found,) = robot.found["imu"]
    assert found.header.frame_id == "imu_link"
    assert found.linear_acceleration.z == pytest.approx(GRAVITY)
    assert found.angular_velocity.z == pytest.approx(math.radians(1000))
    assert (found.orientation.w, found.orientation.z) == (pytest.approx(math.sqrt(0.5)), pytest.approx(math.sqrt(0.5)))
    assert robot.status() == (0, "the board sends")


def test_a_vectornav_board_is_turned_to_x_ahead_and_z_up(device: PluggedDevice) -> None:
    robot = Sensed("imu", device, {"imu": Imu}, protocol="vectornav", baud=115200)
    sentence = "VNYMR,+000.000,+010.000,+000.000,+1.0,-0.2,+3.0,+01.700,+00.100,-09.640,-0.10,-0.20,-0.30"
    robot.hears(framed(sentence))
    (found,) = robot.found["imu"]
    turn = (found.orientation.x, found.orientation.y, found.orientation.z, found.orientation.w)
    ahead = rotate(turn, (1.0, 0.0, 0.0))  # to the north and 10 deg up, in east, north, up
    assert ahead == pytest.approx((0.0, math.cos(math.radians(10)), math.sin(math.radians(10))), abs=1e-9)
    acceleration = found.linear_acceleration
    assert (acceleration.x, acceleration.y, acceleration.z) == pytest.approx((1.7, -0.1, 9.64))
    assert (found.angular_velocity.y, found.angular_velocity.z) == pytest.approx((0.2, 0.3))


def test_cut_and_wrong_packets_are_counted_and_the_next_ones_read(device: PluggedDevice) -> None:
    robot = Sensed("imu", device, {"imu": Imu})
    robot.hears(STILL[:15] + STILL + b"\x01\x02" + STILL)
    assert 1 <= len(robot.found["imu"]) <= 2
    assert robot.status()[0] == 1
    assert set(robot.values) & {"wrong checksums", "garbage"}


@given(st.binary(max_size=200), st.integers(1, 30))
def test_no_bytes_make_the_decoders_fail_and_the_next_packets_are_read(data: bytes, size: int) -> None:
    mixed = data + STILL * 4
    decoder = WitmotionDecoder(Counter())
    found = [one for at in range(0, len(mixed), size) for one in decoder.feed(mixed[at : at + size])]
    assert found
    assert VectornavDecoder(Counter()).feed(data) == []
