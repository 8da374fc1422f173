"""Robot time that is told from outside, as a pure rule: real time is given to it, too."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import DISPUTE, JUMPS, LEAP, NANOSECONDS, PATIENCE, ExternalClock, Turn

EPOCH = 1_700_000_000 * NANOSECONDS


def reach(clock: ExternalClock) -> float:
    """Do as a driver does: go as far as was told."""
    clock.advance_to(clock.limit)
    return clock.now()


def going(outside: int = EPOCH) -> ExternalClock:
    """Return a clock that goes, at robot time 0.1 s and real time 0.1 s."""
    clock = ExternalClock()
    clock.receive(outside, real=0.0)
    assert clock.receive(outside + NANOSECONDS // 10, real=0.1) is Turn.GOES
    reach(clock)
    return clock


@pytest.mark.parametrize("outside", [0, 5, EPOCH])
def test_robot_time_begins_at_zero_wherever_the_outside_does(outside: int) -> None:
    assert going(outside).now() == pytest.approx(0.1)


def test_stamps_are_those_of_the_outside() -> None:
    assert going().stamp() == EPOCH + NANOSECONDS // 10


def test_one_message_is_no_going_time() -> None:
    clock = ExternalClock()
    assert clock.receive(EPOCH, real=0.1) is None
    assert clock.receive(EPOCH, real=0.2) is None
    assert (clock.is_standing, reach(clock)) == (True, 0.0)


def test_a_silent_outside_stands_still_and_that_is_told_once() -> None:
    clock = going()
    assert clock.look(real=0.1 + PATIENCE - 0.01) is None
    assert clock.look(real=0.1 + PATIENCE) is Turn.STANDS
    assert clock.look(real=99.0) is None
    assert clock.is_standing


def test_a_paused_outside_that_repeats_its_time_stands_still() -> None:
    clock = going()
    for real in (0.2, 0.4, 0.6):
        clock.receive(EPOCH + NANOSECONDS // 10, real=real)
    assert clock.look(real=0.61) is Turn.STANDS


def test_nobody_who_tells_time_is_told_too() -> None:
    clock = ExternalClock()
    assert clock.look(real=PATIENCE) is Turn.STANDS


def test_it_goes_on_where_it_stood() -> None:
    clock = going()
    clock.look(real=60.0)
    assert clock.receive(EPOCH + NANOSECONDS // 5, real=60.0) is Turn.GOES
    assert reach(clock) == pytest.approx(0.2)
    assert clock.look(real=60.0 + PATIENCE) is Turn.STANDS


@pytest.mark.parametrize("jump", [-5 * NANOSECONDS, round((LEAP + 1) * NANOSECONDS)])
def test_after_a_jump_it_goes_on_from_where_it_was(jump: int) -> None:
    clock = going()
    there = EPOCH + jump
    assert clock.receive(there, real=0.2) is Turn.JUMPED
    assert [reach(clock), clock.stamp() - there] == pytest.approx([0.1, 0])
    assert clock.receive(there + NANOSECONDS, real=0.3) is None
    assert [reach(clock), clock.stamp() - there] == pytest.approx([1.1, NANOSECONDS])


def test_a_jump_ends_a_standstill() -> None:
    clock = going()
    clock.look(real=5.0)
    assert clock.receive(0, real=5.0) is Turn.JUMPED
    assert not clock.is_standing


def told_by_two(clock: ExternalClock, ahead: float, real: float, seconds: float = 3.0) -> list[Turn]:
    """Let two sources tell the time in turn, the second so far ahead [s], each 50 times a second."""
    turns = []
    for step in range(round(seconds * 50)):
        now = real + 0.02 * step
        for shift in (0.0, ahead):
            turns.append(clock.receive(EPOCH + round((now + shift) * NANOSECONDS), real=now))
            turns.append(clock.look(real=now))
            reach(clock)
    return [turn for turn in turns if turn is not None]


@pytest.mark.parametrize("ahead", [0.5, -0.5, 1000.0, -1000.0])
def test_sources_that_disagree_are_told_once_and_time_stands_still(ahead: float) -> None:
    clock = going()
    turns = told_by_two(clock, ahead, real=0.2)
    assert turns == [*[Turn.JUMPED] * (JUMPS - 1), Turn.DISPUTED]
    assert clock.is_standing
    before = reach(clock)
    assert told_by_two(clock, ahead, real=3.3) == []
    assert reach(clock) == before


def test_when_one_source_is_left_time_goes_on_after_a_while() -> None:
    clock = going()
    told_by_two(clock, -1000.0, real=0.2)
    before = reach(clock)
    turns = []
    for step in range(200):
        real = 3.2 + 0.02 * step
        if turn := clock.receive(EPOCH + round(real * NANOSECONDS), real=real):
            turns.append((real, turn))
    last_jump = 3.2
    assert [turn for _, turn in turns] == [Turn.GOES]
    assert turns[0][0] == pytest.approx(last_jump + DISPUTE, abs=0.1)
    assert reach(clock) == pytest.approx(before + 2.0, abs=0.1)


def test_a_silence_ends_a_dispute() -> None:
    clock = going()
    told_by_two(clock, -1000.0, real=0.2)
    assert clock.look(real=9.0) is Turn.STANDS
    assert clock.receive(EPOCH, real=9.1) is Turn.JUMPED


def test_jumps_with_time_between_them_are_told_each() -> None:
    clock = going()
    for number in range(1, 5):
        assert clock.receive(EPOCH - number * NANOSECONDS, real=number * DISPUTE) is Turn.JUMPED


def test_what_was_told_before_a_jump_and_was_not_reached_is_left_out() -> None:
    clock = going()
    clock.receive(EPOCH + NANOSECONDS, real=0.2)
    clock.receive(EPOCH, real=0.3)
    assert reach(clock) == pytest.approx(0.1)


def test_a_process_that_comes_later_joins_the_time_of_the_others() -> None:
    clock = ExternalClock()
    clock.join(42.0)
    clock.receive(EPOCH, real=0.0)
    clock.receive(EPOCH + NANOSECONDS, real=0.1)
    assert (reach(clock), clock.stamp()) == (43.0, EPOCH + NANOSECONDS)


@given(st.lists(st.integers(-(10**12), 2 * 10**18), max_size=30))
def test_robot_time_never_goes_back_nor_leaps_whatever_is_told(told: list[int]) -> None:
    clock = ExternalClock()
    for number, outside in enumerate(told):
        before = clock.now()
        clock.receive(outside, real=float(number))
        assert before <= reach(clock) <= before + LEAP + 1e-6
        assert clock.stamp() == pytest.approx(outside, abs=2000)
