"""The motor of a simulated servo: it keeps to its profile, settles exactly, warms up with load and always the same."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.twins.servo_fake import FakeServo, MotorTraits, ServoMotor

TRAITS = MotorTraits()
PER_TICK = 0.001  # [rad]
MODELS = sorted(servo_models())
times = st.floats(1e-4, 0.3)


def ordered(servo: FakeServo, **items: int) -> None:
    for name, raw in items.items():
        where = servo.model.items[name]
        assert servo.write(where.address, where.encode(raw)) == 0


@given(
    goals=st.lists(st.integers(-3000, 3000), min_size=1, max_size=8),
    fastest=st.floats(50, 9000),
    acceleration=st.floats(500, 200_000) | st.just(0.0),
    dt=times,
)
def test_it_settles_exactly_at_the_last_goal_whatever_came_before(
    goals: list[int], fastest: float, acceleration: float, dt: float
) -> None:
    motor = ServoMotor(0.0, PER_TICK)
    for goal in goals:
        before = motor.position
        motor.approach(goal, fastest, acceleration, dt)
        most = min(fastest, TRAITS.fastest / PER_TICK)
        assert abs(motor.position - before) <= most * dt + 1e-6
        assert abs(motor.effort) <= 1.0
    for _ in range(200):
        motor.approach(goals[-1], fastest, acceleration, 1.0)
    assert (motor.position, motor.velocity, motor.effort) == (goals[-1], 0.0, 0.0)


@given(goal=st.integers(-3000, 3000), fastest=st.floats(100, 6000), acceleration=st.floats(2000, 100_000))
def test_a_motion_from_rest_never_overshoots(goal: int, fastest: float, acceleration: float) -> None:
    motor, positions = ServoMotor(0.0, PER_TICK), [0.0]
    while motor.position != goal:
        motor.approach(goal, fastest, acceleration, 0.01)
        positions.append(motor.position)
    assert positions == sorted(positions, reverse=goal < 0)
    assert all(abs(position) <= abs(goal) + 1e-6 for position in positions)


def test_speed_and_acceleration_of_a_profile_are_kept_and_the_shaft_lags_behind() -> None:
    servo = FakeServo("XL430-W250", 1)
    acceleration, speed = 2.0, 1.0  # [rad/s^2], [rad/s]
    ordered(
        servo,
        goal_speed=servo.model.to_raw("goal_speed", speed),
        profile_acceleration=servo.model.to_raw("profile_acceleration", acceleration),
        torque_enable=1,
        goal_position=servo.model.to_raw("goal_position", 2.0),
    )
    speeds = []
    for index in range(100):
        servo.step(0.01, 0.01 * index)
        speeds.append(servo.model.to_si("present_speed", servo.get("present_speed")))
    assert speeds[24] == pytest.approx(acceleration * (0.25 - TRAITS.lag), abs=0.06)
    assert speeds[70] == pytest.approx(speed, rel=0.03)
    expected = 1.0 - 0.5 * speed**2 / acceleration - TRAITS.lag * speed
    assert servo.model.to_si("present_position", servo.get("present_position")) == pytest.approx(expected, abs=0.02)


def test_load_shows_while_it_accelerates_and_the_supply_sags() -> None:
    servo = FakeServo("XL430-W250", 1)
    ordered(servo, torque_enable=1, goal_position=3000)
    loads, volts = [], []
    for index in range(100):
        servo.step(0.01, 0.01 * index)
        loads.append(servo.get("present_load"))
        volts.append(servo.get("present_voltage"))
    assert max(loads) > 500
    assert min(loads) < -500  # it brakes
    assert (loads[-1], volts[-1]) == (0, 120)
    assert min(volts) < 120


@pytest.mark.parametrize("dt", [0.01, 0.7])
def test_heat_rises_with_load_and_falls_again(dt: float) -> None:
    servo = FakeServo("XL430-W250", 1)
    ordered(servo, torque_enable=1)

    def after(seconds: float) -> float:
        for index in range(round(seconds / dt)):
            servo.step(dt, dt * index)
        return servo.motor.temperature

    assert after(10) == TRAITS.ambient
    servo.load = 0.8
    assert after(TRAITS.inertia) == pytest.approx(TRAITS.ambient + TRAITS.warming * 0.64 * 0.632, abs=0.5)
    hot = after(300)
    assert hot == pytest.approx(TRAITS.ambient + TRAITS.warming * 0.64, abs=0.5)
    servo.load = 0.0
    assert after(TRAITS.inertia) == pytest.approx(TRAITS.ambient + (hot - TRAITS.ambient) * 0.368, abs=0.5)


@pytest.mark.parametrize("name", ["AX-12", "XL430-W250"])
@given(orders=st.lists(st.tuples(st.integers(-200, 200), times), min_size=1, max_size=10), seed=st.integers(0, 9))
def test_the_same_seed_and_times_give_the_same_values(name: str, orders: list[tuple[int, float]], seed: int) -> None:
    told = []
    for _ in range(2):
        servo, now = FakeServo(name, 1, noise=1.5, seed=seed), 0.0
        ordered(servo, torque_enable=1)
        for goal, dt in orders:
            now += dt
            ordered(servo, goal_position=servo.model.family.centre + goal)
            servo.step(dt, now)
            told.append(bytes(servo.memory))
    assert told[: len(orders)] == told[len(orders) :]


def test_noise_is_as_large_as_it_shall_be_and_differs_between_servos() -> None:
    seen = []
    for id_ in (1, 2):
        servo = FakeServo("XL430-W250", id_, noise=3.0, seed=7)
        found = []
        for index in range(2000):
            servo.step(0.01, 0.01 * index)
            found.append(servo.get("present_position") - 2048)
        assert abs(sum(found) / len(found)) < 0.5
        assert (sum(item * item for item in found) / len(found)) ** 0.5 == pytest.approx(3.0, rel=0.1)
        seen.append(found)
    assert seen[0] != seen[1]


@pytest.mark.parametrize("name", ["AX-12", "MX-28"])
def test_a_servo_that_was_a_wheel_goes_to_its_goal_from_where_it_is(name: str) -> None:
    servo = FakeServo(name, 1)
    ticks = servo.model.family.ticks
    ordered(servo, max_position=0, torque_enable=1, goal_velocity=1000)
    for index in range(200):
        servo.step(0.01, 0.01 * index)
    ordered(servo, torque_enable=0, max_position=ticks - 1, goal_velocity=0)
    servo.step(0.01, 2.0)
    at = servo.get("present_position")
    ordered(servo, torque_enable=1)
    servo.step(0.01, 2.01)
    assert abs(servo.get("present_position") - at) <= 1
    assert 0 <= at < ticks
