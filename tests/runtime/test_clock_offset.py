"""The clock of another host is measured by the reports that go both ways."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus.transport import Arrival, NoTransport
from rbxcompose.compiler.plan.model import OtherHost, Share
from rbxcompose.runtime.channel import HostReport
from rbxcompose.runtime.folder import ClockOffset, Echo, OffsetFilter
from rbxcompose.runtime.process_group.router import HostLine, host_key
from rbxcompose.sdk.ports import Qos

DELAYS = st.integers(10_000, 1_000_000_000)  # [ns]
MILLI = 1_000_000  # [ns]


@given(st.integers(-(10**10), 10**10), st.lists(st.tuples(DELAYS, DELAYS, DELAYS), min_size=1, max_size=60))
def test_the_offset_is_known_to_within_its_uncertainty_and_that_never_grows_in_a_short_time(
    offset: int, exchanges: list[tuple[int, int, int]]
) -> None:
    measured, now, widths = OffsetFilter(), 10**18, list[float]()
    for way_there, pause, way_back in exchanges[:40]:
        own = Echo(now, now + way_there + offset)
        answer = Echo(own.arrived + pause, now + way_there + pause + way_back)
        now = answer.arrived
        found = measured.feed(own, answer)
        assert found is not None
        assert abs(found.offset - offset * 1e-9) <= found.uncertainty + 1e-9
        widths.append(found.uncertainty)
    assert widths == sorted(widths, reverse=True)


def test_a_clock_that_is_set_is_measured_anew_and_impossible_stamps_are_ignored() -> None:
    measured = OffsetFilter()
    assert measured.feed(Echo(1000, 1000), Echo(2000, 900)) is None, "the answer came before the question"
    for offset in (0, 5_000 * MILLI):
        own = Echo(10**18, 10**18 + MILLI + offset)
        found = measured.feed(own, Echo(own.arrived, 10**18 + 2 * MILLI))
        assert found is not None
        assert abs(found.offset - offset * 1e-9) <= found.uncertainty


def test_clocks_are_too_far_apart_only_if_that_is_sure() -> None:
    assert ClockOffset(0.1, 0.01).is_too_far
    assert ClockOffset(-0.1, 0.01).is_too_far
    assert not ClockOffset(0.1, 0.09).is_too_far
    assert ClockOffset(-0.0032, 0.0004).words == "3.2 ms behind ours (± 0.4 ms)"


class _Wire(NoTransport):
    """Carries what one host says to those who listen, at once."""

    def __init__(self, listeners: dict[str, list[Callable[[Arrival], None]]]) -> None:
        self._listeners = listeners
        self._key = ""

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        callback()

    def publisher(self, key: str, qos: Qos) -> _Wire:
        self._key = key
        return self

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> _Wire:
        self._listeners.setdefault(key, []).append(arrived)
        return self

    def put(self, payload: bytes, attachment: bytes) -> None:
        for arrived in self._listeners.get(self._key, ()):
            arrived(_Bytes(payload))


class _Bytes:
    attachment = b""

    def __init__(self, payload: bytes) -> None:
        self.payload = payload


def test_hosts_learn_how_far_their_clocks_are_apart_and_strangers_are_ignored() -> None:
    listeners: dict[str, list[Callable[[Arrival], None]]] = {}
    now, ahead, heard = [10**18], 300 * MILLI, dict[str, HostReport]()

    def stamp(ahead: int) -> Callable[[], int]:
        def look() -> int:
            now[0] += MILLI  # each look is a millisecond later
            return now[0] + ahead

        return look

    def line(host: str, other: str, ahead: int) -> HostLine:
        share = Share(host, (OtherHost(other, ()),))
        told = lambda one: heard.update({host: one})  # noqa: E731
        return HostLine("bot", share, _Wire(listeners), told, print, stamp(ahead), lambda *_: None)

    desk, robot = line("desk", "robot", 0), line("robot", "desk", ahead)
    for _ in range(2):
        desk.send(HostReport("desk", "1", "run"))
        robot.send(HostReport("robot", "1", "run"))
    listeners[host_key("bot", "robot")][0](_Bytes(b"{}"))
    found = heard["desk"].clock, heard["robot"].clock
    for clock_offset, offset in zip(found, (0.3, -0.3), strict=True):
        assert clock_offset is not None
        assert abs(clock_offset.offset - offset) <= clock_offset.uncertainty <= 0.003
        assert clock_offset.is_too_far
