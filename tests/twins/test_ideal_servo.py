"""Ideal servos: at their goals at once, without heat, load or lag."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.twins.servo_fake import FakeServo, IdealMotor
from rbxcompose.domains.servos.twins.servo_twin import TwinBus
from tests.loops import for_all

MODELS = sorted(servo_models())
STATE = ("present_position", "present_speed", "present_load", "present_temperature", "moving")


def ideal(model: str, clock: SteppedClock) -> TwinBus:
    return TwinBus([FakeServo(model, 1, motor=IdealMotor)], clock.now)


@given(name=st.sampled_from(MODELS), goals=st.lists(st.integers(-400, 400), min_size=1, max_size=10))
def test_with_torque_it_is_at_its_goal_in_no_time(name: str, goals: list[int]) -> None:
    clock = SteppedClock()
    bus = ideal(name, clock)
    centre = bus.line[1].model.family.centre
    bus.write({1: {"torque_enable": 1}})
    for index, goal in enumerate(goals):
        bus.write({1: {"goal_position": centre + goal}})
        values = bus.read([1], STATE)[1].values
        assert tuple(values.values()) == (centre + goal, 0, 0, 30, 0)
        clock.advance_to(0.01 * index)


@for_all("name", MODELS)
def test_without_torque_it_stays(name: str) -> None:
    clock = SteppedClock()
    bus = ideal(name, clock)
    centre = bus.line[1].model.family.centre
    bus.write({1: {"goal_position": centre + 100}})
    bus.write({1: {"torque_enable": 0}})
    there = bus.read([1], STATE)[1].values["present_position"]
    bus.line[1].set("goal_position", centre - 100)
    clock.advance_to(5.0)
    assert bus.read([1], STATE)[1].values["present_position"] == there


@pytest.mark.parametrize("speed", [-100, 0, 100])
def test_a_wheel_turns_exactly_as_fast_as_it_shall(speed: int) -> None:
    clock = SteppedClock()
    bus = ideal("XL430-W250", clock)
    servo = bus.line[1]
    bus.write({1: {"operating_mode": 1}})
    bus.write({1: {"torque_enable": 1, "goal_velocity": speed}})
    start = servo.get("present_position")
    clock.advance_to(3.0)
    found = bus.read([1], STATE)[1].values
    turned = (found["present_position"] - start) * servo.model.per_tick
    assert turned == pytest.approx(3.0 * servo.model.to_si("goal_velocity", speed), abs=servo.model.per_tick)
    assert found["present_speed"] == speed
