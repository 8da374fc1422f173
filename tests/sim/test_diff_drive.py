"""Promises of the simulated base."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveCore, DiffDriveSimConfig

SETTINGS = DiffDriveSimConfig()
NEVER_TIMES_OUT = DiffDriveSimConfig(command_timeout=1e6)
DT = 0.02
SPEEDS = st.floats(-SETTINGS.max_speed, SETTINGS.max_speed)
RATES = st.floats(-SETTINGS.max_turn_rate, SETTINGS.max_turn_rate)
VELOCITIES = st.builds(Velocity2, SPEEDS, RATES)
DIVISIONS = st.lists(st.floats(0.001, 0.5), min_size=1, max_size=10)


def base_at(velocity: Velocity2, settings: DiffDriveSimConfig = SETTINGS) -> DiffDriveCore:
    """Return a base at the origin that drives at `velocity` and has been told to keep it."""
    base = DiffDriveCore(settings)
    base.velocity = velocity
    base.command(velocity, 0.0)
    return base


@given(VELOCITIES, DIVISIONS)
def test_a_constant_velocity_gives_the_arc_in_closed_form_however_time_is_divided(
    velocity: Velocity2, steps: list[float]
) -> None:
    base, now = base_at(velocity, NEVER_TIMES_OUT), 0.0
    for dt in steps:
        now += dt
        base.step(now, dt)
    expected = Pose2().moved(velocity, now)
    assert base.pose.distance(expected) < 1e-9
    assert abs(wrap_angle(base.pose.heading - expected.heading)) < 1e-9
    assert base.distance == pytest.approx(abs(velocity.linear) * now, abs=1e-9)


@given(VELOCITIES, VELOCITIES, DIVISIONS)
def test_velocity_heading_and_distance_of_a_ramp_do_not_depend_on_how_time_is_divided(
    before: Velocity2, after: Velocity2, steps: list[float]
) -> None:
    divided, whole, now = base_at(before), base_at(before), 0.0
    divided.command(after, 0.0)
    whole.command(after, 0.0)
    for dt in steps:
        now += dt
        divided.step(now, dt)
    whole.step(now, now)
    assert divided.velocity.linear == pytest.approx(whole.velocity.linear, abs=1e-9)
    assert divided.velocity.angular == pytest.approx(whole.velocity.angular, abs=1e-9)
    assert abs(wrap_angle(divided.pose.heading - whole.pose.heading)) < 1e-9
    assert divided.distance == pytest.approx(whole.distance, abs=1e-9)
    assert divided.pose.distance(whole.pose) < 0.05


@given(st.lists(st.builds(Velocity2, st.floats(), st.floats()), max_size=40))
def test_limits_of_speed_and_acceleration_hold_whatever_is_commanded(commands: list[Velocity2]) -> None:
    base, now = DiffDriveCore(SETTINGS), 0.0
    for command in commands:
        base.command(command, now)
        now += 0.1
        before = base.velocity
        base.step(now, 0.1)
        assert abs(base.velocity.linear) <= SETTINGS.max_speed
        assert abs(base.velocity.angular) <= SETTINGS.max_turn_rate
        assert abs(base.velocity.linear - before.linear) <= SETTINGS.acceleration * 0.1 + 1e-9
        assert abs(base.velocity.angular - before.angular) <= SETTINGS.turn_acceleration * 0.1 + 1e-9


@given(VELOCITIES, st.floats(0.005, 0.3))
def test_without_commands_it_rests_after_timeout_and_braking_time(velocity: Velocity2, dt: float) -> None:
    base, now = base_at(velocity), 0.0
    braking = max(abs(velocity.linear) / SETTINGS.acceleration, abs(velocity.angular) / SETTINGS.turn_acceleration)
    while now < SETTINGS.command_timeout + braking + 1e-9:
        now += dt
        base.step(now, dt)
    assert base.at_rest


@given(SPEEDS, st.floats(0.005, 0.3))
def test_a_command_holds_exactly_as_long_as_its_timeout(speed: float, dt: float) -> None:
    base, now = base_at(Velocity2(speed, 0.0)), 0.0
    for _ in range(1000):
        if base.at_rest:
            break
        now += dt
        base.step(now, dt)
    braking = speed**2 / (2 * SETTINGS.acceleration)
    assert base.distance == pytest.approx(abs(speed) * SETTINGS.command_timeout + braking, abs=1e-9)


@pytest.mark.parametrize(
    "command",
    [Velocity2(math.nan, 0.0), Velocity2(0.0, math.inf), Velocity2(1.01, 0.0), Velocity2(0.0, -3.2)],
    ids=["nan", "inf", "absurd speed", "absurd turn"],
)
def test_a_command_that_makes_no_sense_is_dropped_and_counted(command: Velocity2) -> None:
    base = base_at(Velocity2(0.3, 0.0))
    base.command(command, 0.4)
    base.step(2.0, 2.0)
    assert base.dropped == 1
    assert base.at_rest  # neither did it extend the deadline of the command before


def test_a_command_above_a_limit_is_clamped_and_counted() -> None:
    base = DiffDriveCore(NEVER_TIMES_OUT)
    base.command(Velocity2(0.8, -2.0), 0.0)
    base.step(2.0, 2.0)
    assert base.velocity == Velocity2(SETTINGS.max_speed, -SETTINGS.max_turn_rate)
    assert base.clamped == 1
    assert base.dropped == 0


def test_turning_back_counts_the_way_forth_and_back() -> None:
    base = base_at(Velocity2(0.5, 0.0), NEVER_TIMES_OUT)
    base.command(Velocity2(-0.5, 0.0), 0.0)
    base.step(1.0, 1.0)
    assert base.distance == pytest.approx(0.25)
    assert base.pose.distance(Pose2()) < 1e-9


def test_braking_brings_it_to_rest_and_ignores_commands() -> None:
    base = base_at(Velocity2(0.5, 1.0))
    base.brake()
    for now in (0.25, 0.5, 0.75):
        base.command(Velocity2(0.5, 0.0), now)
        base.step(now, 0.25)
    assert base.at_rest
    assert base.distance == pytest.approx(0.125)


def test_release_moves_nothing_until_the_next_command() -> None:
    base = base_at(Velocity2(0.5, 0.0))
    base.brake()
    base.step(0.1, 0.1)
    base.release()
    base.step(0.2, 0.1)
    assert base.velocity.linear == pytest.approx(0.3)
    base.command(Velocity2(0.5, 0.0), 0.2)
    base.step(0.3, 0.1)
    assert base.velocity.linear == pytest.approx(0.4)


def test_a_base_without_commands_stays_where_it_is() -> None:
    base = DiffDriveCore(SETTINGS, Pose2(1.0, 2.0, 0.5))
    base.step(10.0, 10.0)
    assert base.pose == Pose2(1.0, 2.0, 0.5)
    assert base.velocity == AT_REST
