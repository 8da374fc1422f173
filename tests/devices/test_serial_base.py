"""A base at a pseudo-terminal: the core of the sketch, compiled for this machine, is the board."""

from __future__ import annotations

import shutil
import struct
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.domains.bases.components.serial_base import SerialBase
from rbxcompose.domains.bases.wheel_board import (
    BOARD_HELLO,
    BOARD_STATE,
    GREETED,
    SILENT,
    STANDS,
    VERSION,
    BoardLink,
    FrameReader,
    frame,
)
from rbxcompose.domains.bases.wheels import WheelSpeeds
from rbxcompose.domains.devices.serial_ports import SerialLine
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.sensor_msgs import BatteryState
from rbxcompose.testing import Bench, instance
from tests.devices.plugged import PluggedDevice, plugged_in
from tests.project.package import PACKAGE

SOURCE = Path(__file__).with_name("board") / "board.cpp"
SKETCH = PACKAGE / "domains/bases/sketch/wheel_board/wheel_board.ino"
COMPILER = shutil.which("g++") or shutil.which("c++")
STEP = 0.02  # [s]
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no compiler of C++ is here: install g++")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the board as a program."""
    made = tmp_path_factory.mktemp("board") / "board"
    words = [str(COMPILER), "-std=c++11", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-o", str(made), str(SOURCE)]
    subprocess.run(words, check=True, timeout=60)
    return made


class Board:
    """The compiled core, stepped; what it sends is at most that of one step."""

    def __init__(self, program: Path, fault: str = "") -> None:
        self._process = subprocess.Popen([program, fault], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def step(self, milliseconds: int, data: bytes) -> bytes:
        """Give it bytes at a time, and return what it sends then."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(struct.pack("<IH", milliseconds, len(data)) + data)
        self._process.stdin.flush()
        (size,) = struct.unpack("<H", self._process.stdout.read(2))
        return self._process.stdout.read(size)

    def close(self) -> None:
        self._process.communicate(timeout=10)


class Wired:
    """A base on the bench with a board; `cut` changes what passes from the board to the base."""

    def __init__(self, device: PluggedDevice, program: Path, fault: str = "", **config: object) -> None:
        settings = {"port": str(device.path), "ticks_per_metre": 4000, "wheel_distance": "20 cm", **config}
        self.device, self.program = device, program
        self.bench = Bench(instance("base", "serial_base", settings))
        self.board = Board(program, fault)
        self.odom = self.bench.collect("odom", Odometry)
        self.battery = self.bench.collect("battery", BatteryState)
        self.statuses: list[DiagnosticStatus] = self.bench.statuses("base")
        self.is_silent = False
        self.speed: tuple[float, float] | None = None
        self.booted = 0.0

    def run(self, seconds: float, cut: slice = slice(None), noise: bytes = b"") -> None:
        """Let time pass."""
        for _ in range(round(seconds / STEP)):
            if self.speed is not None:
                linear, angular = self.speed
                self.bench.publish("cmd_vel", Twist(linear=Vector3(x=linear), angular=Vector3(z=angular)))
            self.bench.advance(STEP)
            if self.device.is_plugged:
                heard = self.device.read()
                said = self.board.step(round(1000 * (self.bench.clock.now() - self.booted)), heard)
                if not self.is_silent:
                    self.device.write(noise + said[cut])

    def start_board_again(self) -> None:
        self.board.close()
        self.board, self.booted = Board(self.program), self.bench.clock.now()

    @property
    def base(self) -> SerialBase:
        found = self.bench.component("base")
        assert isinstance(found, SerialBase)
        return found

    @property
    def place(self) -> tuple[float, float]:
        at = self.odom[-1].pose.pose.position
        return at.x, at.y

    @property
    def status(self) -> tuple[int, str]:
        return self.statuses[-1].level, self.statuses[-1].message

    @property
    def values(self) -> dict[str, str]:
        return {value.key: value.value for value in self.statuses[-1].values}


@contextmanager
def wired(folder: Path, program: Path, fault: str = "", **config: object) -> Iterator[Wired]:
    with plugged_in(folder / "port") as device:
        found = Wired(device, program, fault, **config)
        try:
            found.run(1.0)
            yield found
        finally:
            found.board.close()


@needs_compiler
def test_the_sketch_is_right_cpp() -> None:
    words = [str(COMPILER), "-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-x", "c++"]
    words += ["-include", str(SOURCE.with_name("Arduino.h")), str(SKETCH)]
    assert subprocess.run(words, capture_output=True, text=True, timeout=60, check=False).stderr == ""


@needs_compiler
def test_it_drives_and_its_odometry_comes_back(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.2, 0.0)
        robot.run(5.2)
        assert robot.place == pytest.approx((1.0, 0.0), abs=0.03)
        assert robot.odom[-1].twist.twist.linear.x == pytest.approx(0.2, abs=0.01)
        assert robot.battery[-1].voltage == pytest.approx(7.4)
        robot.speed = None
        robot.run(2.0)
        assert robot.odom[-1].twist.twist.linear.x == 0.0
        assert robot.status == (0, "rests")


@needs_compiler
def test_a_silent_board_rests_the_base_which_begins_again_from_rest(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.3, 0.0)
        robot.run(2.0)
        robot.is_silent = True
        robot.run(2.0)
        assert robot.base.is_at_rest
        assert robot.status == (2, "the board is not heard: the base rests")
        robot.is_silent = False
        robot.run(0.3)
        assert 0.0 < robot.base.drive.velocity.linear < 0.3
        robot.run(8.0)
        assert robot.status == (0, "drives")
        assert robot.odom[-1].twist.twist.linear.x == pytest.approx(0.3, abs=0.01)


@needs_compiler
def test_a_board_that_hears_nothing_stops_its_motors_by_itself(program: Path) -> None:
    board, link = Board(program), BoardLink(Counter())
    said = b""
    positions = []
    for tick in range(200):
        now = tick * STEP
        positions += [(now, state.left, state.stands) for state in link.feed(said, now)]
        heard = link.speak(now, WheelSpeeds(1000.0, 1000.0)) if now < 1.0 else b""
        said = board.step(round(1000 * now), heard)
    board.close()
    driven = [left for now, left, _ in positions if now < 1.0]
    assert driven[-1] > 700
    assert driven[-1] < positions[-1][1] <= driven[-1] + 300  # 0.2 s and a step at 1000 ticks/s
    assert positions[-1][2]


@needs_compiler
def test_frames_that_are_cut_and_garbage_are_counted_and_the_base_drives_on(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.2, 0.0)
        robot.run(1.0)
        for _ in range(20):
            robot.run(STEP, cut=slice(0, 9))
            robot.run(3 * STEP, noise=b"\x7e\x05garbage")
        robot.run(1.0)
        assert robot.base.drive.velocity.linear == pytest.approx(0.2)
        assert robot.values.keys() >= {"lost frames", "wrong checksums"}
        assert robot.status == (1, "drives; some of what comes cannot be read")


@needs_compiler
def test_a_board_that_starts_again_is_greeted_again_and_the_odometry_goes_on(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.2, 0.0)
        robot.run(3.0)
        before = robot.place[0]
        robot.start_board_again()
        robot.run(2.0)
        assert before < robot.place[0] < before + 0.5
        robot.run(8.0)  # until what was lost is forgotten
        assert robot.status == (0, "drives")


@needs_compiler
@pytest.mark.parametrize("begins", [False, True])
def test_odometry_goes_on_over_a_restart_of_the_base_also_if_the_board_starts_again(
    tmp_path: Path, program: Path, *, begins: bool
) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.2, 0.0)
        robot.run(3.0)
        before = robot.place[0]
        robot.bench.host.failed("base", RuntimeError("planted"))
        robot.speed = None
        if begins:
            robot.start_board_again()
        robot.odom.clear()
        robot.run(3.0)
        assert robot.odom
        assert robot.base.last is not None
        assert all(told.pose.pose.position.x > before - 0.06 for told in robot.odom)
        assert robot.place[0] == pytest.approx(
            before if begins else robot.base.last.left / 4000, abs=0.06 if begins else 1e-6
        )


@needs_compiler
def test_an_unplugged_board_is_reported_and_driven_again_when_it_is_back(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.2, 0.0)
        robot.run(1.0)
        robot.device.unplug()
        robot.run(2.5)
        assert robot.status[0] == 2
        assert "does not exist" in robot.status[1] or "has gone" in robot.status[1]
        assert robot.base.is_at_rest
        robot.device.plug()
        robot.run(4.0)
        assert robot.status == (0, "drives")


@needs_compiler
@pytest.mark.parametrize("gap", [0.1, 2.0])
def test_a_board_that_starts_again_while_it_is_unplugged_moves_nothing(
    tmp_path: Path, program: Path, gap: float
) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.2, 0.0)
        robot.run(3.0)
        robot.speed = None
        robot.run(1.0)
        before = robot.place
        robot.device.unplug()
        robot.run(gap)
        robot.start_board_again()
        robot.device.plug()
        robot.run(5.0)
        assert robot.status == (0, "rests")
        assert robot.place == pytest.approx(before, abs=1e-3)
        assert len([text for text in robot.bench.texts() if "the board has started again" in text]) == 1


@needs_compiler
def test_after_a_stop_the_board_is_told_zero(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program) as robot:
        robot.speed = (0.3, 0.0)
        robot.run(1.0)
        robot.base.stop()
        robot.run(1.0)
        assert robot.odom[-1].twist.twist.linear.x == 0.0
        robot.base.release()
        robot.run(1.0)
        assert robot.odom[-1].twist.twist.linear.x == pytest.approx(0.3, abs=0.01)


@needs_compiler
def test_the_board_as_a_process_at_a_terminal_answers_within_its_time(tmp_path: Path, program: Path) -> None:
    with plugged_in(tmp_path / "port") as device:
        process = subprocess.Popen([program, str(device.far)], pass_fds=[device.far])
        clock, line, link = MonotonicClock(), SerialLine(str(device.path), 115200), BoardLink(Counter())
        line.open()
        moved = 0
        try:
            while moved < 100:
                assert clock.now() < 15.0, "the board does not move"
                for state in link.feed(line.read(0.02), clock.now()):
                    moved = state.left
                line.write(link.speak(clock.now(), WheelSpeeds(2000.0, 2000.0)))
        finally:
            line.close()
            process.kill()
            process.wait(timeout=10)


@needs_compiler
@pytest.mark.parametrize("is_mute", [False, True], ids=["our board", "a board without flags"])
@pytest.mark.parametrize(("fault", "words"), [("swapped", "turns the wrong way"), ("dead", "stands")])
def test_a_wheel_that_does_not_do_what_it_is_commanded_rests_the_base(
    tmp_path: Path, program: Path, fault: str, words: str, *, is_mute: bool
) -> None:
    with wired(tmp_path, program, fault + " mute" * is_mute) as robot:
        robot.speed = (0.1, 0.0)
        robot.run(0.7 if fault == "swapped" else 1.2)
        assert robot.base.is_at_rest
        robot.run(2.0)
        place = robot.place
        robot.run(3.0)
        assert robot.place == place
        assert robot.status == (2, f"the left wheel {words}: the base rests")


@needs_compiler
def test_a_base_that_rests_for_a_wheel_tries_again_after_a_pause_of_commands(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program, "dead") as robot:
        robot.speed = (0.3, 0.0)
        robot.run(3.0)
        assert robot.status[0] == 2
        robot.speed = (0.0, 0.0)
        robot.run(1.2)
        assert robot.base.last is not None
        assert not robot.base.last.has_failed
        assert robot.status == (2, "the left wheel stands: the base rests")
        robot.speed = (0.3, 0.0)
        robot.run(0.2)
        assert not robot.base.is_at_rest
        robot.run(1.0)
        assert robot.base.is_at_rest


@needs_compiler
def test_a_board_whose_wheel_is_swapped_turns_no_motor_until_it_starts_again(tmp_path: Path, program: Path) -> None:
    with wired(tmp_path, program, "swapped") as robot:
        robot.speed = (0.1, 0.0)
        robot.run(3.0)
        robot.speed = None
        robot.run(1.2)
        place = robot.place
        robot.speed = (0.1, 0.0)
        robot.run(2.0)
        assert robot.place == place
        assert robot.status == (2, "a motor has failed: the base rests")


def test_a_board_of_another_version_is_not_driven() -> None:
    link = BoardLink(Counter())
    hello, state = struct.pack("<BH", VERSION + 1, 200), struct.pack("<iiHB", 0, 0, 0, GREETED | STANDS)
    assert list(link.feed(frame(BOARD_HELLO, 0, hello) + frame(BOARD_STATE, 1, state), 0.0)) == []
    assert link.is_of_another_version
    assert not link.is_alive(0.0)
    assert link.speak(1.0, WheelSpeeds(1.0, 1.0))[3] == 1  # hello, and no drive


def test_a_link_is_down_after_its_silence() -> None:
    link = BoardLink(Counter())
    hello, state = struct.pack("<BH", VERSION, 200), struct.pack("<iiHB", 1, 2, 7400, GREETED)
    (found,) = link.feed(frame(BOARD_HELLO, 0, hello) + frame(BOARD_STATE, 1, state), 1.0)
    assert (found.left, found.right, found.voltage) == (1, 2, 7.4)
    assert link.is_alive(1.0 + SILENT)
    assert not link.is_alive(1.01 + SILENT)


@given(st.binary(max_size=200), st.integers(1, 40))
def test_no_bytes_make_the_reader_of_frames_fail_and_it_finds_the_next_ones(data: bytes, size: int) -> None:
    mixed = data + frame(0x82, 7, bytes(11)) * 3
    reader = FrameReader(Counter())
    found = [each for at in range(0, len(mixed), size) for each in reader.feed(mixed[at : at + size])]
    assert found
    assert (found[-1].type, found[-1].number) == (0x82, 7)


@needs_compiler
def test_no_bytes_make_the_board_move(program: Path) -> None:
    import random

    random_ = random.Random(1)
    board = Board(program)
    for tick in range(300):
        data = bytes(random_.choice((0x7E, 1, 2, 4, random_.randrange(256))) for _ in range(60))
        (state,) = (each for each in FrameReader(Counter()).feed(board.step(20 * tick, data)) if each.type == 0x82)
        assert state.payload[:8] == bytes(8)
    board.close()
