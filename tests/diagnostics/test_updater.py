"""Tasks tell what they were told to watch: rates, stamps, and several of them at once."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.sdk.updater import CompositeTask, FrequencyTask, StampTask, TaskStatus, heartbeat

RATES = st.floats(0.05, 200.0)


def after(task: FrequencyTask, rate: float, seconds: int, *, begin: float = 0.0) -> TaskStatus:
    """Return what `task` says when something has happened `rate` times a second for so long."""
    happened, told = 0, task.status(begin)
    for second in range(1, seconds + 1):
        for _ in range(int(rate * second) - happened):
            task.tick()
            happened += 1
        told = task.status(begin + second)
    return told


@given(RATES, RATES)
def test_a_rate_is_told_as_it_is_with_a_tenth_of_tolerance(least: float, rate: float) -> None:
    told = after(FrequencyTask(least), rate, seconds=int(10 / least) + 10)
    counted = max(5.0, 3 / least)  # [s] of the window: it may hold one event more or less
    if rate > 0.9 * least + 1.5 / counted:
        assert told.level is Level.OK
    if rate < 0.9 * least - 1.5 / counted:
        assert told.level in (Level.WARN, Level.ERROR)


@given(RATES, st.floats(0.0, 4.0))
def test_nothing_is_concluded_from_the_first_moments(least: float, seconds: float) -> None:
    task = FrequencyTask(least)
    task.status(0.0)
    assert task.status(seconds).level is Level.OK


def test_silence_is_an_error_and_a_rate_too_high_a_warning() -> None:
    task = FrequencyTask(10.0, 10.0)
    assert after(task, 10.0, 20).level is Level.OK
    assert after(task, 0.0, 20, begin=20.0) == TaskStatus(
        Level.ERROR, "nothing came for 5.0 s", {"rate": "0 Hz", "expected": "10 Hz", "total": "200"}
    )
    told = after(task, 12.0, 20, begin=40.0)
    assert (told.level, told.message) == (Level.WARN, "12 Hz instead of 10 Hz")


@pytest.mark.parametrize(
    ("stamp", "now", "reason"),
    [
        (100.0, 104.9, ""),
        (100.0, 105.1, "a stamp is 5.1 s old, at most 5 s is usual"),
        (100.9, 100.0, ""),
        (101.1, 100.0, "a stamp is 1.1 s ahead of time"),
        (0.0, 100.0, "1 messages have no stamp"),
    ],
)
def test_stamps_are_compared_with_now(stamp: float, now: float, reason: str) -> None:
    task = StampTask()
    task.tick(stamp, now)
    told = task.status(0.0)
    assert (told.level, told.message) == (Level.ERROR if reason else Level.OK, reason)
    assert task.status(1.0).level is Level.OK, "each report counts what came since the one before"


@given(st.lists(st.tuples(st.sampled_from(Level), st.text("ab", max_size=2)), max_size=4))
def test_a_composite_has_the_worst_level_and_the_messages_of_what_is_wrong(parts: list[tuple[Level, str]]) -> None:
    told = CompositeTask(*(lambda now, one=part: TaskStatus(*one) for part in parts)).status(0.0)
    worst = max((level for level, _ in parts), default=Level.OK)
    wrong = [text for level, text in parts if text and (worst is Level.OK or level is not Level.OK)]
    assert (told.level, told.message) == (worst, "; ".join(wrong))


def test_a_heartbeat_is_a_report() -> None:
    assert heartbeat(0.0).level is Level.OK
