"""Promises of a base on wheels."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.domains.bases.wheels import BaseLimits, TwistLimiter, WheelDrive, WheelGeometry, WheelSpeeds

GEOMETRY = WheelGeometry(0.26, 0.04)
LIMITS = BaseLimits()
SMOOTH = BaseLimits(jerk=5.0, turn_jerk=20.0)
SPEEDS, RATES = st.floats(-0.9, 0.9), st.floats(-3.0, 3.0)
VELOCITIES = st.builds(Velocity2, SPEEDS, RATES)
EVEN = [LIMITS, SMOOTH]


@given(VELOCITIES)
def test_the_velocity_of_the_wheels_of_a_velocity_is_that_velocity(velocity: Velocity2) -> None:
    for geometry in (GEOMETRY, WheelGeometry(0.26, 1 / 4100)):
        back = geometry.velocity(geometry.wheels(velocity))
        assert (back.linear, back.angular) == pytest.approx((velocity.linear, velocity.angular), abs=1e-9)


def test_a_left_turn_has_the_right_wheel_faster() -> None:
    wheels = GEOMETRY.wheels(Velocity2(0.2, 1.0))
    assert (wheels.left, wheels.right) == pytest.approx((0.07 / 0.04, 0.33 / 0.04))


@given(st.sampled_from(EVEN), st.lists(st.tuples(VELOCITIES, st.floats(0.001, 0.5)), max_size=40))
def test_no_sequence_of_commands_breaks_a_limit(limits: BaseLimits, steps: list[tuple[Velocity2, float]]) -> None:
    limiter, before, slope, last = TwistLimiter(limits), AT_REST, AT_REST, 0.0
    for target, dt in steps:
        now = limiter.step(target, dt)
        assert abs(now.linear) <= limits.speed + 1e-9
        assert abs(now.angular) <= limits.turn_rate + 1e-9
        change = Velocity2((now.linear - before.linear) / dt, (now.angular - before.angular) / dt)
        assert abs(change.linear) <= limits.acceleration + 1e-8
        assert abs(change.angular) <= limits.turn_acceleration + 1e-8
        between = (dt + last) / 2.0
        if limits.jerk and limits.turn_jerk:
            assert abs(change.linear - slope.linear) <= limits.jerk * between + 1e-8
            assert abs(change.angular - slope.angular) <= limits.turn_jerk * between + 1e-8
        before, slope, last = now, change, dt


@given(st.sampled_from(EVEN), VELOCITIES, st.floats(0.005, 0.2))
def test_the_curvature_is_kept_from_rest_to_a_velocity_and_back(
    limits: BaseLimits, target: Velocity2, dt: float
) -> None:
    limiter = TwistLimiter(limits)
    for wanted in [target] * 40 + [AT_REST] * 40:
        now = limiter.step(wanted, dt)
        assert now.linear * target.angular == pytest.approx(now.angular * target.linear, abs=1e-9)


@given(st.sampled_from(EVEN), VELOCITIES, VELOCITIES, st.floats(0.02, 0.2))
def test_it_reaches_what_is_within_the_limits(
    limits: BaseLimits, first: Velocity2, second: Velocity2, dt: float
) -> None:
    limiter = TwistLimiter(limits)
    for wanted in (first, second):
        now = AT_REST
        for _ in range(int(2.0 / dt) + 3):
            now = limiter.step(wanted, dt)
        expected = limiter.within(wanted)
        assert (now.linear, now.angular) == pytest.approx((expected.linear, expected.angular), abs=1e-9)


@given(st.sampled_from(EVEN), VELOCITIES, st.floats(0.02, 0.3))
def test_without_commands_it_brakes_within_the_limits_to_an_exact_rest(
    limits: BaseLimits, velocity: Velocity2, dt: float
) -> None:
    drive, now = WheelDrive(GEOMETRY, limits), 0.0
    while now < 2.0:
        drive.command(velocity, now)
        now += dt
        drive.step(now, dt)
    braking = max(abs(drive.velocity.linear) / limits.acceleration, abs(drive.velocity.angular) / 3.0)
    end = now + 0.5 + braking + limits.smoothing + 2 * dt
    while now < end:
        now += dt
        drive.step(now, dt)
    assert drive.at_rest
    assert drive.step(now + dt, dt) == WheelSpeeds()


def test_a_timeout_of_zero_lets_a_command_hold_for_ever() -> None:
    drive = WheelDrive(GEOMETRY, LIMITS, command_timeout=0.0)
    drive.command(Velocity2(0.3, 0.0), 0.0)
    for index in range(1, 100):
        drive.step(index * 1.0, 1.0)
    assert drive.velocity == Velocity2(0.3, 0.0)


def test_a_command_ends_at_its_deadline_even_within_a_step() -> None:
    drive = WheelDrive(GEOMETRY, LIMITS)
    drive.command(Velocity2(0.5, 0.0), 0.0)
    drive.step(1.5, 1.5)
    assert drive.at_rest


def test_while_braking_commands_are_ignored_and_after_it_the_next_one_counts() -> None:
    drive = WheelDrive(GEOMETRY, LIMITS)
    drive.command(Velocity2(0.3, 0.0), 0.0)
    drive.step(0.2, 0.2)
    drive.brake()
    drive.command(Velocity2(0.3, 0.0), 0.2)
    drive.step(0.5, 0.3)
    assert drive.at_rest
    drive.release()
    drive.step(0.6, 0.1)
    assert drive.at_rest
    drive.command(Velocity2(0.3, 0.0), 0.6)
    drive.step(0.7, 0.1)
    assert drive.velocity.linear == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("velocity", "reason"),
    [
        (Velocity2(math.nan, 0.0), "nan m/s and 0 rad/s is not a finite velocity"),
        (Velocity2(0.0, math.inf), "0 m/s and inf rad/s is not a finite velocity"),
        (Velocity2(2.0, 0.0), "2 m/s and 0 rad/s is 4.0 times too fast"),
    ],
)
def test_what_is_no_sane_velocity_is_refused_with_the_reason(velocity: Velocity2, reason: str) -> None:
    drive = WheelDrive(GEOMETRY, LIMITS)
    assert drive.command(velocity, 0.0) == reason
    drive.step(0.1, 0.1)
    assert drive.at_rest


def test_a_command_that_is_scaled_down_is_counted() -> None:
    drive = WheelDrive(GEOMETRY, LIMITS, command_timeout=0.0)
    assert drive.command(Velocity2(0.8, 0.8), 0.0) is None
    for index in range(20):
        drive.step(index * 0.1, 0.1)
    assert drive.clamped == 1
    assert (drive.velocity.linear, drive.velocity.angular) == pytest.approx((0.5, 0.5))


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match=r"must be positive and finite, not 0\.0"):
        WheelGeometry(0.26, 0.0)
    with pytest.raises(ValueError, match="positive and finite"):
        WheelGeometry(0.26, math.inf)
    with pytest.raises(ValueError, match="above 0"):
        BaseLimits(jerk=0.0)
    with pytest.raises(ValueError, match="a step must be positive"):
        WheelDrive(GEOMETRY, LIMITS).step(0.0, 0.0)
