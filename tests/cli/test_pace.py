"""How often something comes, and how evenly."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.tools.commands.topic import PaceMeter, measured


def test_even_arrivals_have_a_rate_and_no_jitter() -> None:
    pace = measured([0.0, 0.5, 1.0, 1.5])
    assert pace is not None
    assert (pace.rate, pace.shortest, pace.longest, pace.jitter, pace.messages) == (2.0, 0.5, 0.5, 0.0, 4)


@pytest.mark.parametrize("times", [[], [1.0], [1.0, 1.0]])
def test_too_little_has_no_pace(times: list[float]) -> None:
    assert measured(times) is None


def test_only_the_window_counts() -> None:
    meter = PaceMeter(3)
    for time in (0.0, 10.0, 10.5, 11.0):
        meter.arrived(time)
    pace = meter.take()
    assert pace is not None
    assert (pace.rate, pace.messages) == (2.0, 3)


def test_what_is_old_is_not_told_again() -> None:
    meter = PaceMeter(3)
    meter.arrived(0.0)
    meter.arrived(1.0)
    assert meter.take() is not None
    assert meter.take() is None


@given(st.lists(st.floats(0.001, 10.0), min_size=1, max_size=30))
def test_the_mean_lies_between_the_shortest_and_the_longest(intervals: list[float]) -> None:
    times = [sum(intervals[:count]) for count in range(len(intervals) + 1)]
    pace = measured(times)
    assert pace is not None
    assert pace.shortest * 0.999 <= 1 / pace.rate <= pace.longest * 1.001
    assert pace.jitter <= pace.longest - pace.shortest + 1e-9
