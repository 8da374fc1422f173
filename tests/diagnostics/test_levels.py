"""Promises of levels."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level, level_of


@given(st.integers())
def test_a_number_that_means_no_level_is_an_error(number: int) -> None:
    assert level_of(number) == (number if 0 <= number <= 3 else Level.ERROR)
