from __future__ import annotations

import pytest

from rbxcompose.base.clock import MonotonicClock, SteppedClock


def test_a_stepped_clock_stands_still_until_it_is_moved() -> None:
    clock = SteppedClock()
    clock.advance_to(1.5)
    assert (clock.now(), clock.stamp()) == (1.5, 1_500_000_000)
    with pytest.raises(ValueError, match="backwards"):
        clock.advance_to(1.0)


def test_real_clocks_with_one_start_tell_one_time() -> None:
    first = MonotonicClock()
    second = MonotonicClock(first.start)
    assert 0.0 <= first.now() <= second.now()
