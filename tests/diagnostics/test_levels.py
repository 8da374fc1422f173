"""Promises of levels."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.levels import Level, combined, level_of

OK, WARN, ERROR, STALE = Level


@pytest.mark.parametrize(
    ("levels", "group"),
    [
        ([], OK),
        ([OK, OK], OK),
        ([OK, WARN], WARN),
        ([ERROR, WARN], ERROR),
        ([STALE, STALE], STALE),
        ([STALE, OK], ERROR),
        ([STALE, ERROR], ERROR),
    ],
)
def test_a_group_is_as_bad_as_its_worst_part_but_stale_only_as_a_whole(levels: list[Level], group: Level) -> None:
    assert combined(levels) is group


@given(st.lists(st.sampled_from(Level), min_size=1))
def test_a_group_is_never_better_than_a_part_that_reports(levels: list[Level]) -> None:
    assert all(combined(levels) >= level for level in levels if level is not STALE)
    assert min(levels) <= combined(levels) <= max(levels) or combined(levels) is ERROR


@given(st.integers())
def test_a_number_that_means_no_level_is_an_error(number: int) -> None:
    assert level_of(number) == (number if 0 <= number <= 3 else ERROR)
