"""Periods that were met and missed, on a grid."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.components.servo_bus import Periods


@given(st.lists(st.integers(1, 5), min_size=1, max_size=50), st.floats(0.0, 0.9))
def test_each_period_is_met_or_missed(steps: list[int], late: float) -> None:
    periods, number = Periods(0.01), 0
    periods.begin(late * 0.01)
    for step in steps:
        number += step
        periods.begin((number + late) * 0.01)
    assert periods.met + periods.missed == number + 1
    assert periods.met == len(steps) + 1
    assert periods.share_met == pytest.approx((len(steps) + 1) / (number + 1))
    assert periods.late(0.99) == pytest.approx(late * 0.01, abs=1e-9)


def test_a_pause_misses_nothing() -> None:
    periods = Periods(0.01)
    periods.begin(0.0)
    periods.pause()
    periods.begin(10.0)
    assert (periods.met, periods.missed) == (2, 0)
