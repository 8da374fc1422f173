"""Promises of calibrations."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.transmission import Calibration, Pair

STEPS = st.lists(st.tuples(st.floats(0.01, 5.0), st.floats(0.01, 5.0)), min_size=2, max_size=9)


def calibration(steps: list[Pair], direction: float = 1.0) -> Calibration:
    """Return one whose numbers go up, or down for the second ones, by these steps."""
    first, second = (list(itertools.accumulate(values)) for values in zip(*steps, strict=True))
    return Calibration(tuple((x, direction * y) for x, y in zip(first, second, strict=True)))


@given(STEPS, st.sampled_from([1.0, -1.0]), st.floats(0.0, 1.0))
def test_both_directions_agree_and_pass_every_pair(steps: list[Pair], direction: float, share: float) -> None:
    table = calibration(steps, direction)
    for x, y in table.pairs:
        assert table.value(x) == pytest.approx(y)
        assert table.inverse(y) == pytest.approx(x)
    between = table.pairs[0][0] + share * (table.pairs[-1][0] - table.pairs[0][0])
    assert table.inverse(table.value(between)) == pytest.approx(between, abs=1e-9)


def test_outside_of_the_pairs_the_nearest_end_holds() -> None:
    table = Calibration(((0.0, 3.0), (1.0, 1.0)))
    assert (table.value(-5.0), table.value(5.0)) == (3.0, 1.0)
    assert (table.inverse(-5.0), table.inverse(5.0)) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("pairs", "reason"),
    [
        (((0.0, 1.0),), "two pairs or more"),
        (((0.0, 1.0), (0.0, 2.0)), "0 follows 0"),
        (((0.0, 1.0), (0.1, 2.0), (0.2, 1.5)), "1.5 follows 2"),
        (((0.0, 1.0), (0.1, 1.0)), "1 follows 1"),
        (((0.0, 1.0), (0.1, math.nan)), "finite"),
    ],
)
def test_pairs_that_cannot_be_read_in_both_directions_are_refused(pairs: tuple[Pair, ...], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Calibration(pairs)
