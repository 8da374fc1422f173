"""A wheel that does not do what it is commanded is noticed, and one that only lags or is pushed is not."""

from __future__ import annotations

import math
from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.bases.wheel_watch import WheelWatch
from tests.loops import for_all

STEP = 0.02  # [s]


def judged(
    command: Callable[[float], float],
    wheel: Callable[[float], float],
    seconds: float = 6.0,
    tick: float = 2.5e-4,
    every: int = 1,
) -> tuple[str, float]:
    """Return the first fault, and when [s], of a wheel at these speeds [m/s], of which each `every`th state comes."""
    watch, way, before = WheelWatch(), 0.0, 0.0
    for step in range(round(seconds / STEP)):
        now = step * STEP
        way += wheel(now) * STEP
        if step % every:
            continue
        counted = math.floor(way / tick) * tick
        watch.update(command(now), counted - before, now)
        before = counted
        if fault := watch.fault(is_urgent=False):
            return fault, now
    return "", seconds


def ramp(now: float) -> float:
    """Go forwards and backwards at up to 0.5 m/s, by 1 m/s^2, with a rest at the start."""
    return max(-0.5, min(0.5, abs((now - 0.5) % 4.0 - 2.0) - 1.0)) if now > 0.5 else 0.0


@for_all(
    "lag, tick, every", [(lag, tick, n) for lag in (0.0, 0.1, 0.25) for tick in (1e-4, 2e-3, 1e-2) for n in (1, 2, 7)]
)
def test_a_wheel_that_lags_is_fine_also_with_a_coarse_encoder_and_lost_states(
    lag: float, tick: float, every: int
) -> None:
    _is_fine(ramp, lambda now: ramp(now - lag), tick=tick, every=every)


def test_a_push_by_hand_at_rest_is_fine() -> None:
    _is_fine(lambda now: 0.0, lambda now: 1.5 * math.sin(now))


def test_a_wheel_that_still_slows_down_from_its_last_direction_is_fine() -> None:
    _is_fine(
        lambda now: -0.5 if now < 2.0 else 0.02,
        lambda now: -0.5 if now < 2.0 else 0.02 - 0.52 * math.exp((2.0 - now) / 0.4),
    )


def test_a_wheel_that_is_held_at_a_crawl_is_fine() -> None:
    _is_fine(lambda now: 0.04, lambda now: 0.0)


@given(st.floats(0.03, 1.0))
def test_a_wheel_at_its_speed_is_fine_at_any_speed(speed: float) -> None:
    _is_fine(lambda now: speed, lambda now: speed, tick=1e-2)


@given(st.sampled_from((-1, 1)), st.floats(0.06, 1.0))
def test_each_fault_is_noticed_within_its_time(direction: int, speed: float) -> None:
    speed *= direction
    for words, factor, within in (
        ("turns the wrong way", -1.0, 0.6),
        ("is far faster than commanded", 6.0, 0.6),
        ("stands", 0.0, 1.1),
    ):
        fault, when = judged(lambda now: speed, lambda now, factor=factor: factor * speed)  # type: ignore[misc]
        assert (fault, when <= within) == (words, True)


def test_a_failed_motor_names_its_wheel_at_once() -> None:
    watch = WheelWatch()
    for step in range(8):
        watch.update(0.1, -0.004, step * STEP)
    assert not watch.fault(is_urgent=False)
    assert watch.fault(is_urgent=True) == "turns the wrong way"


def _is_fine(
    command: Callable[[float], float], wheel: Callable[[float], float], tick: float = 2.5e-4, every: int = 1
) -> None:
    assert judged(command, wheel, tick=tick, every=every) == ("", 6.0)
