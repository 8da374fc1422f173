from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus.local import BURST, MOST_SOURCES, QUIET, Allowance, Allowances

rates = st.floats(0.5, 5000.0)


@given(rate=rates, gaps=st.lists(st.floats(0.0, 0.05), max_size=200))
def test_no_more_is_taken_than_the_rate_and_one_burst(rate: float, gaps: list[float]) -> None:
    allowance, now, taken = Allowance(rate), 0.0, 0
    for gap in gaps:
        now += gap
        taken += allowance.takes(now)
    assert taken <= max(1.0, rate * BURST) + rate * now + 1e-6


@given(rate=rates, slack=st.floats(1.01, 3.0))
def test_who_stays_below_the_rate_loses_nothing(rate: float, slack: float) -> None:
    allowance = Allowance(rate)
    assert all(allowance.takes(number * slack / rate) for number in range(100))


def test_a_flood_leaves_room_for_what_comes_after_it() -> None:
    allowance = Allowance(100.0)
    assert sum(allowance.takes(0.0) for _ in range(1000)) == 10
    assert allowance.takes(0.011)


def test_a_clock_of_another_thread_that_lags_gives_nothing_back() -> None:
    allowance = Allowance(1.0)
    assert [allowance.takes(now) for now in (1.0, 0.5, 1.4)] == [True, False, False]


@pytest.mark.parametrize("rate", [0.1, 1.0])
def test_the_slowest_input_takes_its_first_message(rate: float) -> None:
    assert Allowance(rate).takes(7.0)


def test_a_flood_costs_other_sources_nothing() -> None:
    allowances, taken = Allowances(100.0), 0
    for number in range(1000):
        taken += sum(allowances.takes(b"flood", number * 0.01) for _ in range(100))
        assert allowances.takes(b"calm", number * 0.01)
    assert taken <= 100.0 * (10.0 + BURST)


def test_a_name_for_each_message_is_no_way_around_it() -> None:
    allowances = Allowances(100.0)
    taken = sum(allowances.takes(bytes([number % 251, number // 251]), 0.0) for number in range(10_000))
    assert taken <= MOST_SOURCES + 100.0 * BURST


def test_sources_that_went_away_make_room() -> None:
    allowances = Allowances(10.0)
    for number in range(MOST_SOURCES):
        allowances.takes(bytes([number]), 0.0)
    later = 2 * QUIET
    assert [allowances.takes(b"new", later), allowances.takes(b"newer", later)] == [True, True]
