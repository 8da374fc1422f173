"""A level follows its number: at once to the better but for hysteresis, after patience to the worse."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.monitors import LimitCore, Limits

NUMBERS = st.floats(-10, 10)
SORTED = st.lists(st.floats(-5, 5), min_size=4, max_size=4).map(sorted)


@given(SORTED, NUMBERS, st.floats(0, 3))
def test_a_number_has_the_level_of_the_limits_beyond_which_it_is(
    four: list[float], number: float, hysteresis: float
) -> None:
    error_below, warn_below, warn_above, error_above = four
    limits = Limits(warn_below, error_below, warn_above, error_above, hysteresis)
    expected = Level.OK
    if number < warn_below or number > warn_above:
        expected = Level.WARN
    if number < error_below or number > error_above:
        expected = Level.ERROR
    assert limits.level(number) is expected
    for before in (Level.WARN, Level.ERROR):
        assert limits.level(number, since=before) >= expected, "hysteresis never makes it better"
        if error_below + hysteresis <= number <= error_above - hysteresis:
            assert limits.level(number, since=before) <= Level.WARN
    assert limits.level(math.nan) is Level.ERROR


@given(st.lists(NUMBERS, max_size=30), st.floats(0, 2))
def test_hysteresis_keeps_a_noisy_number_from_flapping(noise: list[float], hysteresis: float) -> None:
    core = LimitCore(Limits(warn_above=0.0, hysteresis=hysteresis))
    for at, number in enumerate(noise):
        before, level = core.level, core.feed(float(at), number)
        if before is Level.WARN and level is Level.OK:
            assert number <= -hysteresis


def test_what_is_worse_counts_after_a_while_and_what_is_better_at_once() -> None:
    core = LimitCore(Limits(warn_above=1.0, patience=2.0))
    told = [core.feed(at, number) for at, number in ((0, 2.0), (1, 2.0), (1.5, 0.0), (2, 2.0), (3.9, 2.0), (4, 2.0))]
    assert told == [Level.OK] * 5 + [Level.WARN]
    assert core.feed(4.1, 0.5) is Level.OK
