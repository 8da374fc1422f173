"""Links that only seem to be whole are found by what hosts report of each other, and nothing else is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.runtime.folder import Echo
from rbxcompose.runtime.process_group.router import FRESH, LONGEST, PATIENCE, OneWayLinks

PERIOD = 0.25  # [s] of reports
AHEAD = 3600.0  # [s] by which the clocks of the others are ahead
Hearing = Callable[[str, str, float], bool]


def run(
    hears: Hearing,
    seconds: float,
    *,
    hosts: str = "rdm",
    own: str = "m",
    tells: bool = True,
    ways: Callable[[float], bool] = lambda now: False,
) -> list[float]:
    """Return when `own` opens its links again [s], if `hears(listener, teller, now)` says who hears whom.

    `ways` tells when a host that is not heard would accept a connection.
    """
    links, opened, arrived = OneWayLinks(own, 0.0), [], dict[tuple[str, str], float]()
    for step in range(1, round(seconds / PERIOD)):
        now = step * PERIOD
        if tells:
            links.sent(now)
        for teller in hosts:
            for listener in hosts:
                if listener != teller and hears(listener, teller, now):
                    arrived[listener, teller] = now
        for teller in hosts:
            is_heard = teller != own and hears(own, teller, now)
            if is_heard and links.receive(teller, _stamp(now), _echoes(arrived, teller), now) is not None:
                opened.append(now)
        if links.must_seek(now) and ways(now) and links.find(now):
            opened.append(now)
    return opened


def _stamp(at: float) -> int:
    return round((at + AHEAD) * 1e9)


def _echoes(arrived: Mapping[tuple[str, str], float], listener: str) -> dict[str, Echo]:
    return {teller: Echo(0, _stamp(at)) for (who, teller), at in arrived.items() if who == listener}


def test_hosts_that_all_hear_each_other_are_left_alone() -> None:
    assert run(lambda *_: True, 60.0) == []


@given(cut=st.floats(1.0, 20.0), length=st.floats(0.0, 20.0))
def test_so_are_those_that_were_cut_off(cut: float, length: float) -> None:
    assert run(lambda listener, teller, now: "m" not in (listener, teller) or not cut < now < cut + length, 60.0) == []


@given(cut=st.floats(2.0, 20.0), length=st.floats(0.0, 20.0), dialling=st.floats(0.0, 1.0))
def test_and_those_that_dial_again_when_the_cut_is_over(cut: float, length: float, dialling: float) -> None:
    def hears(listener: str, teller: str, now: float) -> bool:
        return "m" not in (listener, teller) or not cut < now < cut + length + dialling

    assert run(hears, 60.0, ways=lambda now: not cut < now < cut + length) == []


@pytest.mark.parametrize("hosts", ["rm", "rdm"])
def test_a_host_that_neither_hears_nor_is_heard_is_found_once_there_is_a_way(hosts: str) -> None:
    def hears(listener: str, teller: str, now: float) -> bool:
        return "m" not in (listener, teller) or now < 5.0

    first, *_ = run(hears, 30.0, hosts=hosts, ways=lambda now: now > 9.0)
    assert 9.0 + PATIENCE < first < 9.0 + PATIENCE + FRESH + 2 * PERIOD


def test_one_that_has_never_been_heard_is_waited_for() -> None:
    assert run(lambda listener, teller, now: "m" not in (listener, teller), 60.0, ways=lambda now: True) == []


def test_and_those_one_of_which_has_died() -> None:
    assert run(lambda listener, teller, now: teller != "d" or now < 5.0, 60.0) == []


@pytest.mark.parametrize("hosts", ["rm", "rdm"])
def test_a_host_that_is_heard_but_hears_nothing_is_found(hosts: str) -> None:
    first, *_ = run(lambda listener, teller, now: (listener, teller) != ("r", "m") or now < 5.0, 12.0, hosts=hosts)
    assert 5.0 + PATIENCE < first < 5.0 + FRESH + PATIENCE + 2 * PERIOD


def test_so_is_one_that_another_hears_and_this_one_does_not() -> None:
    first, *_ = run(lambda listener, teller, now: (listener, teller) != ("m", "r") or now < 5.0, 12.0)
    assert 5.0 + PATIENCE < first < 5.0 + 2 * FRESH + PATIENCE


def test_what_opening_does_not_cure_is_tried_ever_more_seldom() -> None:
    opened = run(lambda listener, teller, now: (listener, teller) != ("r", "m"), 900.0)
    pauses = [after - before for before, after in pairwise(opened)]
    assert all(after >= before - PERIOD for before, after in pairwise(pauses))
    assert pauses[-1] >= LONGEST


def test_a_host_that_does_not_report_doubts_nobody() -> None:
    assert run(lambda listener, teller, now: teller != "m", 60.0, tells=False) == []
