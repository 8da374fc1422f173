"""The blocking port on a pseudo-terminal: deadlines, exact lengths, echo, and clear words for what is wrong."""

from __future__ import annotations

import os
import time
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.devices.serial_ports import LostPortError, PortError, latency_of, slow_adapter
from rbxcompose.domains.servos.dynamixel_port import BlockingPort


class Line:
    """Both ends of a pseudo-terminal: the port under test, and the descriptor of the other side."""

    def __init__(self, baud: int = 1_000_000) -> None:
        self.far, self.near = os.openpty()
        tty.setraw(self.near)
        self.path = os.ttyname(self.near)
        self.port = BlockingPort(self.path, baud)

    def cut(self) -> None:
        os.close(self.far)
        self.far = -1

    def close(self) -> None:
        self.port.closePort()
        os.close(self.near)
        if self.far >= 0:
            os.close(self.far)


@pytest.fixture
def line() -> Iterator[Line]:
    made = Line()
    yield made
    made.close()


def test_a_read_gives_just_the_bytes_that_are_asked_for_and_keeps_the_others(line: Line) -> None:
    os.write(line.far, b"abcdefgh")
    line.port.setPacketTimeoutMillis(1000)
    assert [line.port.readPort(length) for length in (3, 0, -1, 4)] == [b"abc", b"", b"", b"defg"]
    assert line.port.getBytesAvailable() == 1


@given(st.lists(st.binary(min_size=1, max_size=40), max_size=6), st.integers(0, 3))
def test_nothing_is_lost_or_reordered_between_reads(chunks: list[bytes], back: int) -> None:
    line = Line()
    try:
        for chunk in chunks:
            os.write(line.far, chunk)
        line.port.setPacketTimeoutMillis(1000)
        whole = b"".join(line.port.readPort(len(chunk)) for chunk in reversed(chunks))
        assert whole == b"".join(chunks)
        line.port.unread(whole[:back])
        assert line.port.readPort(len(whole[:back])) == whole[:back]
    finally:
        line.close()


def test_a_read_waits_until_the_deadline_without_using_the_processor(line: Line) -> None:
    line.port.setPacketTimeoutMillis(60)
    began, used = time.monotonic(), time.thread_time()
    assert line.port.readPort(4) == b""
    assert line.port.isPacketTimeout()
    assert time.monotonic() - began > 0.05
    assert time.thread_time() - used < 0.02


def test_what_has_come_before_the_deadline_counts_even_if_it_is_read_later(line: Line) -> None:
    os.write(line.far, b"late")
    line.port.setPacketTimeoutMillis(0)
    assert line.port.readPort(4) == b"late"
    os.write(line.far, b"more")
    assert line.port.readPort(4) == b""
    assert line.port.isPacketTimeout()


def test_a_deadline_is_the_time_on_the_wire_and_the_timeout() -> None:
    now = [5.0]
    far, near = os.openpty()
    port = BlockingPort(os.ttyname(near), 9600, timeout=0.003, clock=lambda: now[0])
    port.writePort([0] * 8)
    port.writePort([0] * 2)
    port.reply_delay = 0.0005
    port.wait_for(10, replies=2)
    due = 20 * 10 / 9600 + 0.001 + 0.003
    port._has_looked = True
    for elapsed, is_over in ((due - 1e-6, False), (due + 1e-6, True)):
        now[0] = 5.0 + elapsed
        assert port.isPacketTimeout() is is_over
    port.closePort()
    os.close(far)
    os.close(near)


def test_an_echo_is_dropped(line: Line) -> None:
    line.port.has_echo = True
    line.port.writePort([1, 2, 3])
    os.write(line.far, os.read(line.far, 100) + b"reply")
    line.port.setPacketTimeoutMillis(1000)
    assert line.port.readPort(5) == b"reply"


@pytest.mark.parametrize("baud", [200_000, 250_000, 400_000, 4_500_000])
def test_any_baud_rate_is_taken(baud: int) -> None:
    line = Line(baud)
    assert line.port.getBaudRate() == baud
    line.close()


def test_an_unplugged_port_is_told_at_any_use(line: Line) -> None:
    line.cut()
    line.port.setPacketTimeoutMillis(1000)
    for use in (lambda: line.port.readPort(1), lambda: line.port.writePort([1]), lambda: line.port.getBytesAvailable()):
        with pytest.raises(LostPortError, match="has gone"):
            use()


def test_a_second_program_is_refused(line: Line) -> None:
    with pytest.raises(PortError, match="used by another program"):
        BlockingPort(line.path, 1_000_000)


@pytest.mark.parametrize(("path", "code"), [("/dev/nothing-here", "RBX2201"), ("/dev/null", "RBX2204")])
def test_what_cannot_be_opened_is_told_with_its_cause(path: str, code: str) -> None:
    with pytest.raises(PortError) as caught:
        BlockingPort(path, 1_000_000)
    finding = caught.value.finding()
    assert (finding.code, path in finding.message, bool(finding.help)) == (code, True, True)


def test_a_forbidden_port_names_the_group(monkeypatch: pytest.MonkeyPatch, line: Line) -> None:
    def forbidden(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", forbidden)
    with pytest.raises(PortError, match="may not be opened") as caught:
        BlockingPort(line.path, 1_000_000)
    assert "dialout" in caught.value.finding().help


def test_the_latency_timer_of_an_adapter_is_read_and_warned_of(tmp_path: Path) -> None:
    file = tmp_path / "sys/bus/usb-serial/devices/ttyUSB0/latency_timer"
    file.parent.mkdir(parents=True)
    file.write_text("16\n")
    latency = latency_of("/dev/ttyUSB0", tmp_path)
    assert latency == 0.016
    warning = slow_adapter("/dev/ttyUSB0", latency)
    assert warning is not None
    assert "16 ms" in warning.message
    assert 'ATTR{latency_timer}="1"' in warning.help
    assert slow_adapter("/dev/ttyUSB0", 0.001) is slow_adapter("/dev/x", latency_of("/dev/ttyUSB1", tmp_path)) is None
