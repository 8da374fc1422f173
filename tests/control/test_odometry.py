"""Promises of where a base is by its wheels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, Velocity2, wrap_angle
from rbxcompose.domains.bases.wheels import OdometryPolicy, WheelGeometry, WheelOdometry

GEOMETRY = WheelGeometry(0.26, 0.04)
POLICY = OdometryPolicy()
VELOCITIES = st.builds(Velocity2, st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))


def drive(odometry: WheelOdometry, legs: list[tuple[Velocity2, float]], *, offset: float = 0.0) -> Pose2:
    """Let the wheels roll along arcs, given with their durations [s], with a reading at the end of each."""
    geometry, true, now = odometry.geometry, odometry.pose, 0.0
    left, right = offset, offset

    def read(at: float) -> float:
        return at if geometry.counts is None else math.floor(at) % geometry.counts

    odometry.update(read(left), read(right), now)
    for velocity, duration in legs:
        wheels = geometry.wheels(velocity)
        left, right, now = left + wheels.left * duration, right + wheels.right * duration, now + duration
        true = true.moved(velocity, duration)
        assert odometry.update(read(left), read(right), now) is None
    return true


def test_a_quarter_turn_at_ten_readings_per_second_is_exact() -> None:
    radius, speed = 0.6, 0.3
    odometry = WheelOdometry(GEOMETRY, POLICY)
    duration = radius * math.pi / 2 / speed
    steps = math.ceil(duration / 0.1)
    drive(odometry, [(Velocity2(speed, speed / radius), duration / steps)] * steps)
    assert odometry.pose.distance(Pose2(radius, radius)) < 2e-4
    assert odometry.pose.distance(Pose2(radius, radius)) < 1e-12
    assert odometry.pose.heading == pytest.approx(math.pi / 2)


@given(st.lists(st.tuples(VELOCITIES, st.floats(0.01, 1.0)), max_size=20))
def test_arcs_are_followed_exactly(legs: list[tuple[Velocity2, float]]) -> None:
    odometry = WheelOdometry(GEOMETRY, POLICY, Pose2(1.0, -2.0, 0.5))
    true = drive(odometry, legs)
    assert odometry.pose.distance(true) < 1e-9
    assert abs(wrap_angle(odometry.pose.heading - true.heading)) < 1e-9
    if legs:
        now = odometry.velocity
        assert (now.linear, now.angular) == pytest.approx((legs[-1][0].linear, legs[-1][0].angular), abs=1e-6)


@pytest.mark.parametrize("speed", [0.4, -0.4])
def test_counts_of_encoders_that_start_again_at_zero_lose_nothing(speed: float) -> None:
    odometry = WheelOdometry(WheelGeometry(0.26, 1 / 4100, counts=4096), POLICY)
    true = drive(odometry, [(Velocity2(speed, speed), 0.1)] * 100, offset=2048.0)
    assert odometry.pose.distance(true) < 5e-3  # ticks of 0.24 mm turn the base by 0.5 mrad
    assert abs(wrap_angle(odometry.pose.heading - true.heading)) < 2e-3


@given(VELOCITIES, st.integers(1, 30))
def test_the_covariance_grows_with_the_way_and_is_one(velocity: Velocity2, steps: int) -> None:
    odometry = WheelOdometry(GEOMETRY, POLICY)
    drive(odometry, [(velocity, 0.1)] * steps)
    before = odometry.covariance
    assert np.allclose(before, before.T)
    assert np.linalg.eigvalsh(before).min() >= -1e-12
    moved = WheelOdometry(GEOMETRY, POLICY)
    drive(moved, [(velocity, 0.1)] * (steps + 1))
    assert moved.covariance[2, 2] >= before[2, 2]
    if abs(velocity.linear) > 0.01:
        assert moved.covariance[2, 2] > before[2, 2]


def test_the_heading_is_as_uncertain_as_its_formula_says() -> None:
    odometry = WheelOdometry(GEOMETRY, POLICY)
    drive(odometry, [(Velocity2(0.5, 0.0), 0.1)] * 40)
    assert odometry.covariance[2, 2] == pytest.approx(2 * 1e-4 * 2.0 / 0.26**2)
    assert odometry.covariance[0, 0] == pytest.approx(1e-4 * 2.0 / 2)
    assert odometry.covariance[1, 1] > odometry.covariance[0, 0]


def test_a_base_at_rest_does_not_become_more_uncertain() -> None:
    odometry = WheelOdometry(GEOMETRY, POLICY)
    drive(odometry, [(Velocity2(), 0.1)] * 10)
    assert not odometry.covariance.any()


def test_readings_that_cannot_be_do_not_count_and_it_is_said_why() -> None:
    odometry = WheelOdometry(GEOMETRY, OdometryPolicy(greatest_speed=1.0))
    assert odometry.update(0.0, 0.0, 0.0) is None
    assert odometry.update(math.nan, 0.0, 0.1) == "the wheels are at nan and 0.0, at 0.1 s: not finite"
    assert odometry.update(1.0, 1.0, 0.0) == "a reading of 0.000 s came after one of 0.000 s"
    assert odometry.update(500.0, 0.0, 0.1) == "a wheel has jumped: it would have moved at 200 m/s"
    assert odometry.pose == Pose2()
    assert odometry.update(501.0, 1.0, 0.2) is None
    assert odometry.pose.x == pytest.approx(0.04)


def test_velocities_are_averaged_over_the_window_and_a_late_reading_is_no_jump() -> None:
    policy = OdometryPolicy(greatest_speed=1.0, resolution=6e-5, window=0.1)
    odometry = WheelOdometry(GEOMETRY, policy)
    for index in range(40):
        tick = math.floor(0.3 * 0.01 * index / 6e-5) * 6e-5 / 0.04  # as a servo tells it
        assert odometry.update(tick, tick, 0.01 * index) is None
    assert odometry.velocity.linear == pytest.approx(0.3, abs=1e-3)
    assert 0.0 < odometry.velocity_covariance[0, 0] < 1e-3
    at = 0.3 * 0.4 / 0.04
    assert odometry.update(at, at, 0.3901) is None
    assert odometry.update(at + 10.0, at + 10.0, 0.41) is not None
