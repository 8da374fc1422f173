"""Fake servos in stepped time: they move, hold, heat up and shut down as the e-manual says."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.twins.servo_fake import FASTEST, FakeServo
from rbxcompose.domains.servos.twins.servo_line import FakeLine, packet_one, packet_two, packets
from tests.loops import for_all

MODELS = sorted(servo_models())
ONE, TWO = ["AX-12", "MX-28"], ["XL430-W250", "XM430-W350", "PH54-200"]


def written(servo: FakeServo, item: str, raw: int) -> int:
    """Write an item as an instruction does; return the result."""
    where = servo.model.items[item]
    return servo.write(where.address, where.encode(raw))


@for_all("name", MODELS)
def test_each_model_is_read_and_written_at_each_register(name: str) -> None:
    servo = FakeServo(name, 7)
    for item in servo.model.items.values():
        data = servo.read(item.address, item.size)
        assert data is not None
        assert servo.get(item.name) == item.decode(data)
    assert (servo.id, servo.baud, servo.get("model_number")) == (7, 1_000_000, servo.model.number)
    assert written(servo, "led", 1) == 0
    assert servo.get("led") == 1
    assert written(servo, "present_position", 5) != 0


@for_all("name", MODELS)
def test_it_goes_to_its_goal_at_the_speed_that_is_set(name: str) -> None:
    servo = FakeServo(name, 1)
    centre = servo.get("present_position")
    goal = centre + round(1.0 / servo.model.per_tick)
    written(servo, "goal_speed", servo.model.to_raw("goal_speed", 0.5))
    written(servo, "torque_enable", 1)
    assert written(servo, "goal_position", goal) == 0
    for step in range(100):
        servo.step(0.01, 0.01 * step)
    assert servo.model.to_si("present_position", servo.get("present_position")) == pytest.approx(0.5, abs=0.02)
    assert servo.model.to_si("present_speed", servo.get("present_speed")) == pytest.approx(0.5, rel=0.05)
    assert servo.get("moving") == 1
    for step in range(100, 250):
        servo.step(0.01, 0.01 * step)
    assert (servo.get("present_position"), servo.get("moving"), servo.get("present_speed")) == (goal, 0, 0)


@for_all("name", MODELS)
@pytest.mark.parametrize("direction", [1, -1])
def test_a_wheel_turns_without_an_end(name: str, direction: int) -> None:
    servo = FakeServo(name, 1)
    if servo.model.family.modes:
        written(servo, "operating_mode", servo.model.family.modes["velocity"])
    else:
        written(servo, "max_position", 0)
    written(servo, "torque_enable", 1)
    assert written(servo, "goal_velocity", direction * servo.model.to_raw("goal_velocity", 2.0)) == 0
    for step in range(10):
        servo.step(0.1, 0.1 * step)
    assert servo.get("moving") == 1
    if servo.model.protocol == 2 and servo.model.name != "XL-320":
        turned = servo.model.to_si("present_position", servo.get("present_position"))
        assert turned == pytest.approx(direction * 2.0, rel=0.03)


@for_all("name", ONE)
def test_writing_a_goal_switches_torque_on_in_protocol_1(name: str) -> None:
    servo = FakeServo(name, 1)
    written(servo, "goal_position", 600)
    assert servo.get("torque_enable") == 1


@pytest.mark.parametrize("holds", [True, False])
def test_switching_torque_on_holds_or_snaps_to_the_old_goal(holds: bool) -> None:
    servo = FakeServo("XL430-W250", 1, holds_on_enable=holds)
    servo.move_to(3000)
    assert written(servo, "goal_position", 1000) == 0
    assert servo.get("torque_enable") == 0
    servo.step(1.0, 1.0)
    assert servo.get("present_position") == 3000
    written(servo, "torque_enable", 1)
    servo.step(1.0, 2.0)
    assert servo.get("present_position") == (3000 if holds else 1000)


@for_all("name", [*ONE, *TWO])
def test_too_much_heat_switches_torque_off_and_is_told(name: str) -> None:
    servo = FakeServo(name, 1)
    written(servo, "torque_enable", 1)
    servo.motor.temperature = servo.get("temperature_limit") + 1
    servo.step(0.1, 0.1)
    assert servo.get("torque_enable") == 0
    assert servo.alert == (4 if servo.model.protocol == 1 else 128)
    written(servo, "torque_enable", 1)
    servo.step(0.1, 0.2)
    assert servo.get("torque_enable") == 0
    servo.motor.temperature = 30
    servo.step(0.1, 0.3)
    if servo.model.protocol == 2:
        assert servo.get("hardware_error") == 4, "it stays until the servo starts again"
        servo.reboot()
        servo.step(0.1, 0.4)
    assert servo.alert == 0
    assert written(servo, "torque_enable", 1) == 0


def test_too_much_load_switches_torque_off() -> None:
    servo = FakeServo("XM430-W350", 1)
    written(servo, "torque_enable", 1)
    servo.load = 1.5
    servo.step(0.1, 0.1)
    assert (servo.get("hardware_error"), servo.get("torque_enable")) == (32, 0)


@for_all("name", TWO)
def test_memory_that_lasts_is_locked_while_torque_is_on(name: str) -> None:
    servo = FakeServo(name, 1)
    written(servo, "torque_enable", 1)
    assert written(servo, "id", 9) == 7
    written(servo, "torque_enable", 0)
    assert written(servo, "id", 9) == 0
    assert servo.id == 9


@pytest.mark.parametrize(("name", "error"), [("AX-12", 2), ("XL430-W250", 6)])
def test_a_goal_beyond_the_limits_is_refused(name: str, error: int) -> None:
    servo = FakeServo(name, 1)
    written(servo, "max_position", 700)
    assert written(servo, "goal_position", 701) == error
    assert written(servo, "goal_position", 700) == 0


def test_the_watchdog_stops_a_wheel_when_the_bus_is_silent() -> None:
    clock = SteppedClock()
    line = FakeLine([FakeServo("XL430-W250", 1)], clock.now)
    servo = line[1]
    written(servo, "operating_mode", 1)
    written(servo, "torque_enable", 1)
    written(servo, "bus_watchdog", 10)
    written(servo, "goal_velocity", 100)
    for tick in range(1, 20):
        clock.advance_to(0.01 * tick)
        line.advance()
    assert servo.get("present_speed") == 100
    clock.advance_to(0.25)
    line.advance()
    clock.advance_to(0.3)
    assert (line[1].get("present_speed"), servo.get("bus_watchdog")) == (0, -1)
    assert written(servo, "goal_velocity", 100) == 4
    written(servo, "bus_watchdog", 0)
    assert written(servo, "goal_velocity", 100) == 0


@given(st.sampled_from(MODELS), st.lists(st.tuples(st.integers(-2000, 6000), st.floats(0, 0.5)), max_size=20))
def test_no_step_is_faster_than_the_fastest(name: str, goals: list[tuple[int, float]]) -> None:
    servo, now = FakeServo(name, 1), 0.0
    written(servo, "torque_enable", 1)
    for goal, dt in goals:
        before, now = servo.get("present_position"), now + dt
        where = servo.model.items["goal_position"]
        written(servo, "goal_position", max(where.least, min(where.most, goal)))
        servo.step(dt, now)
        assert abs(servo.get("present_position") - before) * servo.model.per_tick <= FASTEST * dt + servo.model.per_tick


def test_both_protocols_are_heard_on_one_line() -> None:
    line = FakeLine([FakeServo("AX-12", 3), FakeServo("XL430-W250", 3)], SteppedClock().now)
    [fake_reply] = line.receive(packet_one(3, 1))
    [two] = line.receive(packet_two(3, 1))
    assert [packet.protocol for reply in (fake_reply, two) for packet in packets(bytearray(reply.data))] == [1, 2]
    assert line.receive(packet_one(3, 1), baud=57_600) == []


@pytest.mark.parametrize("silences", [False, True])
def test_a_mute_servo_is_passed_over_or_silences_those_after_it(silences: bool) -> None:
    line = FakeLine([FakeServo("XL430-W250", number) for number in (1, 2, 3)], SteppedClock().now)
    line[2].faults.is_mute, line[2].faults.silences_next = True, silences
    replies = line.receive(packet_two(254, 0x82, bytes([132, 0, 4, 0, 1, 2, 3])))
    assert [reply.data[4] for reply in replies] == ([1] if silences else [1, 3])


def test_replies_take_their_time_on_the_wire() -> None:
    line = FakeLine([FakeServo("XL430-W250", number) for number in (1, 2)], SteppedClock().now)
    first, second = line.receive(packet_two(254, 0x82, bytes([132, 0, 4, 0, 1, 2])), 1_000_000)
    assert first.after == pytest.approx(0.0005 + 15e-5)
    assert second.after == pytest.approx(2 * first.after)
