"""Promises of the limits of joints."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.limits import Limiter, MotionLimits, tightened

LIMITS = MotionLimits(-1.0, 2.0, 1.5, 3.0)
POSITIVE = st.floats(0.01, 100.0)
RANGED = st.builds(
    lambda middle, half, *rest: MotionLimits(middle - half, middle + half, *rest),
    st.floats(-5.0, 5.0),
    st.floats(0.0, 5.0),
    st.none() | POSITIVE,
    st.none() | POSITIVE,
    st.none() | POSITIVE,
)
STEPS = st.lists(st.tuples(st.floats(-20.0, 20.0), st.floats(-5.0, 5.0), st.floats(1e-5, 5.0)), max_size=60)


def acceleration(limits: MotionLimits) -> float:
    return math.inf if limits.acceleration is None else limits.acceleration


@given(RANGED, st.floats(0.0, 1.0), STEPS)
def test_no_sequence_of_wishes_and_steps_breaks_a_limit(
    limits: MotionLimits, start: float, steps: list[tuple[float, float, float]]
) -> None:
    limiter = Limiter(limits, limits.clamped(limits.least + start * (limits.greatest - limits.least)))
    for wanted, velocity, dt in steps:
        before = limiter.position, limiter.velocity
        assert limiter.want(wanted, velocity) is None
        limiter.step(dt)
        assert limits.least <= limiter.position <= limits.greatest
        assert abs(limiter.velocity) <= limits.speed + 1e-9
        assert abs(limiter.velocity - before[1]) <= acceleration(limits) * dt + 1e-9
        assert limiter.position - before[0] == pytest.approx(limiter.velocity * dt, abs=1e-9)


@given(RANGED, STEPS, st.floats(0.0, 1.0), st.floats(0.001, 0.2))
def test_it_converges_to_a_goal_in_range_without_overshoot(
    limits: MotionLimits, steps: list[tuple[float, float, float]], share: float, dt: float
) -> None:
    limiter = Limiter(limits, limits.clamped(0.0))
    goal = limits.clamped(limits.least + share * (limits.greatest - limits.least))
    side = goal >= limiter.position
    slowest = min(limits.speed, acceleration(limits), 1.0)
    limiter.want(goal)
    for _ in range(min(2000, int(3 * (10.0 / slowest + 1.0) / dt) + 10)):
        limiter.step(dt)
        if abs(limiter.position - goal) < 1e-9:
            break
        assert (limiter.position <= goal) == side
    else:
        assert slowest * dt * 2000 < 30.0  # only because so little time has passed
        return
    for _, _, dt_ in steps:
        limiter.step(dt_)
        assert limiter.position == pytest.approx(goal, abs=1e-9)


@given(st.floats(0.5, 3.0), st.floats(0.005, 0.05))
def test_a_path_within_the_limits_is_tracked_without_lag_if_its_velocity_is_given(period: float, dt: float) -> None:
    amplitude = 0.1 * (period / math.tau) ** 2 * 3.0
    limiter, before = Limiter(LIMITS, 0.0), 0.0
    for index in range(1, 100):
        wanted = amplitude * (1.0 - math.cos(math.tau * index * dt / period))
        limiter.want(wanted, (wanted - before) / dt)
        limiter.step(dt)
        assert limiter.position == pytest.approx(wanted, abs=1e-9)
        before = wanted


@given(STEPS)
def test_braking_ends_at_rest_within_the_shortest_way_and_stays_there(steps: list[tuple[float, float, float]]) -> None:
    limiter = Limiter(LIMITS, 0.0)
    for wanted, velocity, dt in steps:
        limiter.want(wanted, velocity)
        limiter.step(dt)
    start, way = limiter.position, limiter.velocity**2 / (2 * 3.0)
    limiter.brake()
    for _ in range(200):
        limiter.step(0.01)
    assert abs(limiter.position - start) == pytest.approx(way, abs=1e-9)
    assert abs(limiter.velocity) < 1e-9


@pytest.mark.parametrize(("wanted", "velocity"), [(math.nan, 0.0), (math.inf, 0.0), (0.5, math.nan)])
def test_what_is_not_finite_is_rejected_with_the_reason_and_the_former_wish_holds(
    wanted: float, velocity: float
) -> None:
    limiter = Limiter(LIMITS, 0.0)
    limiter.want(1.0)
    reason = limiter.want(wanted, velocity)
    assert reason is not None
    assert "finite" in reason
    for _ in range(300):
        limiter.step(0.01)
    assert limiter.position == pytest.approx(1.0)


@given(st.floats(2.0, 4.0), st.lists(st.floats(-9.0, 9.0), max_size=50))
def test_a_joint_that_was_put_outside_of_its_range_moves_inwards_only(start: float, wishes: list[float]) -> None:
    limiter = Limiter(LIMITS, 0.0)
    limiter.reseed(start)
    for wanted in wishes:
        before = limiter.position
        limiter.want(wanted)
        limiter.step(0.1)
        assert limiter.position <= max(2.0, before)
    limiter.want(9.0)
    for _ in range(100):
        limiter.step(0.1)
    assert limiter.position == pytest.approx(2.0)


def test_after_a_measurement_it_starts_at_rest_from_there() -> None:
    limiter = Limiter(LIMITS, 0.0)
    limiter.want(1.0)
    limiter.step(0.1)
    limiter.reseed(0.5)
    assert limiter.is_at_rest
    limiter.step(0.1)
    assert limiter.position == 0.5


def test_a_lower_limit_of_velocity_is_reached_by_braking() -> None:
    limiter = Limiter(MotionLimits(velocity=1.5, acceleration=3.0), 0.0)
    limiter.want(100.0)
    for _ in range(100):
        limiter.step(0.01)
    limiter.limits = MotionLimits(velocity=0.5, acceleration=3.0)
    for _ in range(100):
        before = limiter.velocity
        limiter.step(0.01)
        assert before - limiter.velocity <= 0.03 + 1e-9
    assert limiter.velocity == 0.5


@pytest.mark.parametrize("dt", [0.0, -0.1, math.nan, math.inf])
def test_a_step_takes_time(dt: float) -> None:
    with pytest.raises(ValueError, match="no step"):
        Limiter(LIMITS, 0.0).step(dt)


@given(RANGED, RANGED)
def test_tightening_never_widens(outer: MotionLimits, inner: MotionLimits) -> None:
    tight = tightened(outer, inner).limits
    if tight is None:
        assert max(outer.least, inner.least) > min(outer.greatest, inner.greatest)
        return
    for limits in (outer, inner):
        assert limits.least <= tight.least <= tight.greatest <= limits.greatest
        assert tight.speed <= limits.speed
        assert acceleration(tight) <= acceleration(limits)


def test_what_the_manifest_would_widen_is_said() -> None:
    result = tightened(LIMITS, MotionLimits(-2.0, 1.0, 9.0))
    assert result.limits == MotionLimits(-1.0, 1.0, 1.5, 3.0)
    assert result.wider == ("lower", "velocity")


def test_ranges_without_a_common_position_leave_nothing() -> None:
    assert tightened(LIMITS, MotionLimits(lower=3.0)).limits is None


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"lower": 1.0, "upper": 0.0}, "above the upper"),
        ({"velocity": math.nan}, "'velocity' is nan"),
        ({"velocity": -1.0}, "not below 0"),
        ({"acceleration": 0.0}, "cannot stop"),
    ],
)
def test_limits_that_cannot_hold_are_refused(values: dict[str, float], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        MotionLimits(**values)
