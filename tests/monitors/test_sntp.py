"""Offsets of clocks are as RFC 4330 has them, and nothing else counts as an answer."""

from __future__ import annotations

import socket
import struct
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.diagnostics.components.clock_monitor import ERA, NoTimeError, measure, offset, question

NOW = 1_700_000_000.0
ANSWER = struct.Struct("!BBbb5I2I2I2I")
HALF = 2**31


def words(unix: float) -> tuple[int, int]:
    """Return a time as a server writes it; after 2036 its seconds begin again."""
    seconds, part = divmod(unix + ERA, 1)
    return int(seconds) % 2**32, int(part * 2**32)


def answer(asked: bytes, arrived: float, left: float, *, first: int = 0x24, stratum: int = 2) -> bytes:
    return ANSWER.pack(
        first, stratum, 0, 0, *(0,) * 5, *struct.unpack("!2I", asked[40:48]), *words(arrived), *words(left)
    )


@given(st.floats(0, 4e9), st.floats(-1e4, 1e4), st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_the_error_is_at_most_half_of_the_time_on_the_way(
    sent: float, ahead: float, there: float, inside: float, back: float
) -> None:
    sent = max(sent, HALF - ERA + 2e4)  # the second half of NTP's first era begins in 1968
    arrived = sent + there + ahead
    got = offset(answer(question(sent), arrived, arrived + inside), sent, sent + there + inside + back)
    assert abs(got - ahead) <= (there + back) / 2 + 1e-5


@pytest.mark.parametrize(
    "wrong",
    [
        b"",
        b"\0" * 47,
        question(NOW),
        answer(question(NOW + 1), NOW, NOW),
        answer(question(NOW), NOW, NOW, first=0xE4),
        answer(question(NOW), NOW, NOW, stratum=0),
        answer(question(NOW), NOW, NOW, stratum=16),
    ],
)
def test_anything_else_is_refused(wrong: bytes) -> None:
    with pytest.raises(NoTimeError):
        offset(wrong, NOW, NOW)


def test_a_server_is_asked_by_udp_and_one_that_is_silent_is_told() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))

        def serve() -> None:
            asked, who = server.recvfrom(100)
            server.sendto(answer(asked, NOW + 2.0, NOW + 2.0), who)

        thread = threading.Thread(target=serve)
        thread.start()
        port = server.getsockname()[1]
        assert measure("127.0.0.1", 5.0, lambda: NOW, port) == pytest.approx(2.0)
        thread.join()
        with pytest.raises(NoTimeError, match="timed out"):
            measure("127.0.0.1", 0.01, lambda: NOW, port)
