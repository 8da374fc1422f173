"""Promises of curves through knots."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.curves import (
    Curve,
    JointSample,
    braking,
    calmed_velocities,
    cubic,
    quintic,
    resting,
    spline_velocities,
    straight,
)

NUMBERS = st.floats(-3.0, 3.0)
KNOTS = st.lists(
    st.tuples(st.floats(0.1, 2.0), st.builds(JointSample, NUMBERS, NUMBERS, NUMBERS)), min_size=2, max_size=8
)
Knots = list[tuple[float, JointSample]]


def parts(knots: Knots) -> tuple[list[float], list[JointSample], list[float], list[float]]:
    """Return times, samples, positions and velocities."""
    times = list(itertools.accumulate(gap for gap, _ in knots))
    times = [time - times[0] for time in times]
    samples = [sample for _, sample in knots]
    return times, samples, [sample.position for sample in samples], [sample.velocity for sample in samples]


def curves(knots: Knots) -> list[Curve]:
    times, samples, positions, velocities = parts(knots)
    spline = spline_velocities(times, positions, velocities[0], 0.0)
    return [
        straight(times, positions),
        cubic(times, positions, velocities),
        cubic(times, positions, spline),
        cubic(times, positions, calmed_velocities(times, positions, spline)),
        quintic(times, samples),
    ]


@given(KNOTS)
def test_every_curve_passes_its_knots(knots: Knots) -> None:
    times, _, positions, _ = parts(knots)
    for curve in curves(knots):
        assert [curve.sample(time).position for time in times] == pytest.approx(positions, abs=1e-9)


@given(KNOTS)
def test_curves_pass_knots_with_the_velocities_and_accelerations_given(knots: Knots) -> None:
    times, samples, _, velocities = parts(knots)
    _, hermite, _, _, fifth = curves(knots)
    for time, sample in zip(times[1:-1], samples[1:-1], strict=True):
        for near in (time - 1e-9, time + 1e-9):
            assert hermite.sample(near).velocity == pytest.approx(sample.velocity, abs=1e-5)
            assert fifth.sample(near).velocity == pytest.approx(sample.velocity, abs=1e-5)
            assert fifth.sample(near).acceleration == pytest.approx(sample.acceleration, abs=1e-3)
    assert hermite.sample(0.0).velocity == velocities[0]


@given(KNOTS)
def test_the_spline_has_no_jump_of_acceleration_and_ends_at_rest(knots: Knots) -> None:
    times, _, _, velocities = parts(knots)
    spline = curves(knots)[2]
    for time in times[1:-1]:
        before, after = spline.sample(time - 1e-9), spline.sample(time + 1e-9)
        assert before.acceleration == pytest.approx(after.acceleration, abs=1e-3)
    assert spline.sample(0.0).velocity == velocities[0]
    assert spline.sample(times[-1] - 1e-9).velocity == pytest.approx(0.0, abs=1e-5)


@given(KNOTS)
def test_the_derivatives_are_those_of_the_position(knots: Knots) -> None:
    times, h = parts(knots)[0], 1e-4
    for curve in curves(knots):
        for first, second in itertools.pairwise(times):
            middle = (first + second) / 2
            before, now, after = (curve.sample(middle + shift) for shift in (-h, 0.0, h))
            assert now.velocity == pytest.approx((after.position - before.position) / (2 * h), abs=1e-2)
            assert now.acceleration == pytest.approx((after.velocity - before.velocity) / (2 * h), abs=1e-1)


@given(KNOTS)
def test_extent_and_speed_bound_every_sample_and_are_reached(knots: Knots) -> None:
    shares = [index / 20 for index in range(20)] + [1 - 1e-12]
    for curve in curves(knots):
        low, high = curve.extent
        pieces = itertools.pairwise(curve.times)
        samples = [curve.sample(start + share * (end - start)) for start, end in pieces for share in shares]
        fastest, highest = max(abs(sample.velocity) for sample in samples), max(sample.position for sample in samples)
        assert fastest - 1e-6 <= curve.speed <= 1.1 * fastest + 1e-6
        assert low - 1e-6 <= min(sample.position for sample in samples)
        assert highest - 1e-6 <= high <= highest + 0.1 * (high - low) + 1e-6


@given(KNOTS)
def test_a_calmed_curve_does_not_overshoot_between_its_knots(knots: Knots) -> None:
    times, _, positions, _ = parts(knots)
    spline = spline_velocities(times, positions, 0.0, 0.0)
    calm = cubic(times, positions, calmed_velocities(times, positions, spline))
    assert calm.extent == pytest.approx((min(positions), max(positions)), abs=1e-9)


@given(NUMBERS, NUMBERS, st.none() | st.floats(0.1, 5.0))
def test_braking_keeps_the_range_and_ends_at_rest(position: float, velocity: float, acceleration: float | None) -> None:
    curve = braking(JointSample(position, velocity), acceleration, -3.0, 3.0)
    assert curve.first == position
    assert -3.0 - 1e-9 <= curve.extent[0] <= curve.extent[1] <= 3.0 + 1e-9
    assert curve.sample(curve.duration + 1.0).velocity == 0.0
    if acceleration is not None and abs(position) < 3.0 and abs(velocity) > 1e-300:  # a brake takes some time
        assert curve.sample(0.0).velocity == velocity
        assert abs(curve.sample(0.0).acceleration) >= acceleration * (1 - 1e-12)
        assert curve.sample(curve.duration * (1 - 1e-12)).velocity == pytest.approx(0.0, abs=1e-6)


def test_before_and_after_a_curve_the_joint_rests() -> None:
    curve = cubic((0.0, 1.0), (0.0, 1.0), (2.0, 2.0))
    assert curve.sample(-0.1) == JointSample(0.0)
    assert curve.sample(1.1) == JointSample(1.0)
    assert resting(0.4).sample(9.0) == JointSample(0.4)


def test_a_clamped_curve_rests_at_its_bounds() -> None:
    curve = straight((0.0, 1.0), (0.0, 1.0)).clamped(0.0, 0.5)
    assert curve.sample(0.4) == JointSample(0.4, 1.0)
    assert curve.sample(0.7) == JointSample(0.5)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_sample_tells_whether_it_is_finite(value: float) -> None:
    assert not JointSample(0.0, value).is_finite
