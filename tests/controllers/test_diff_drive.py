"""A base on two wheels: where it is, how it brakes, and what it does when something fails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.domains.bases.controllers.diff_drive import DiffDriveConfig, DiffDriveController
from rbxcompose.domains.servos.controller_manager import SwitchControllers
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.testing import instance
from tests.controllers.wheels import DISTANCE, RADIUS, STEP, Rover, wheels
from tests.soak import rare

QUARTER = 0.6, 0.15  # radius of the path [m], speed [m/s]
UNIT = 0.02398 * RADIUS  # [m/s], the least step of a wheel's speed
commands = st.tuples(
    st.floats(-0.7, 0.7) | st.sampled_from([math.nan, math.inf]), st.floats(-2.5, 2.5), st.sampled_from([0.1, 0.3, 0.8])
)


def way_of_arbotix(ways: list[tuple[float, float]]) -> Pose2:
    """Return where the driver of the book would say that a base is: it turns the heading back instead of forth."""
    x = y = heading = 0.0
    for left, right in ways:
        way, turn = (left + right) / 2, (right - left) / DISTANCE
        x, y = x + math.cos(heading - turn) * way, y + math.sin(heading - turn) * way
        heading += turn
    return Pose2(x, y, heading)


@pytest.mark.parametrize("model", ["XL430-W250", *rare("MX-28")])
def test_after_a_quarter_turn_at_ten_cycles_per_second_it_knows_where_it_is(model: str) -> None:
    rover, (radius, speed) = Rover(model, rate=10.0), QUARTER
    rover.drive(speed, speed / radius, radius * math.pi / 2 / speed)
    rover.command(0.0)
    rover.advance(2.0)
    assert rover.is_still
    assert rover.true.heading == pytest.approx(math.pi / 2, abs=0.1)
    error = rover.pose.distance(rover.true)
    assert error < 2e-4
    assert abs(wrap_angle(rover.pose.heading - rover.true.heading)) < 1e-3
    speeds = np.array(rover.speeds)
    every = round(0.1 / STEP)
    ways = [tuple(part.sum(axis=0) * STEP) for part in np.split(speeds, range(every, len(speeds), every))]
    assert way_of_arbotix(ways).distance(rover.true) > 0.025


def test_the_driver_of_the_book_would_be_wrong_by_centimetres() -> None:
    radius, steps = 0.6, 32  # a quarter turn at 0.3 m/s and 10 Hz
    turn = math.pi / 2 / steps
    ways = [((radius - DISTANCE / 2) * turn, (radius + DISTANCE / 2) * turn)] * steps
    assert way_of_arbotix(ways).distance(Pose2(radius, radius)) == pytest.approx(0.063, abs=0.02)


def test_a_base_whose_servos_take_less_speed_is_slower_on_the_same_curve() -> None:
    rover, (radius, speed) = Rover(max_speed=1.0), QUARTER
    for servo in rover.servos:
        servo.set("velocity_limit", 120)
    rover.driver.prepare()
    rover.drive(3 * speed, 3 * speed / radius, 3.0)
    left, right = rover.speeds[-1]
    assert right == pytest.approx(120 * UNIT, abs=UNIT)
    assert (right + left) / (right - left) * DISTANCE / 2 == pytest.approx(radius, abs=0.02)
    assert any("turns at most 2.88 rad/s" in text for text in rover.bench.texts())


def test_what_it_tells_has_covariances_and_frames() -> None:
    rover = Rover()
    frames = rover.bench.collect("/tf", TFMessage)
    rover.drive(0.15, 0.3, 2.0)
    told = rover.told[-1]
    pose, twist = told.pose.covariance.reshape(6, 6), told.twist.covariance.reshape(6, 6)
    assert (told.header.frame_id, told.child_frame_id) == ("odom", "base_footprint")
    assert told.twist.twist.linear.x == pytest.approx(0.15, abs=2 * UNIT)
    assert told.twist.twist.angular.z == pytest.approx(0.3, abs=0.02)
    for covariance in (pose, twist):
        assert np.allclose(covariance, covariance.T)
        assert np.linalg.eigvalsh(covariance).min() >= -1e-12
        assert covariance[2, 2] > 1e5
    assert 0 < pose[5, 5] < 0.01
    assert 0 < twist[0, 0] < 0.001
    link = frames[-1].transforms[0]
    assert (link.header.frame_id, link.child_frame_id) == ("odom", "base_footprint")
    assert link.transform.translation.x == told.pose.pose.position.x
    assert 45 <= len(rover.told) / 2.2 <= 51  # [Hz]


def test_without_tf_it_writes_no_frame() -> None:
    config = DiffDriveConfig(left="left", right="right", wheel_distance=0.2, wheel_radius=0.1, odometry={"tf": False})
    assert "tf" not in DiffDriveController.ports("base", config)
    rover = Rover(odometry={"tf": False})
    frames = rover.bench.collect("/tf", TFMessage)
    rover.advance(0.1)
    assert rover.told
    assert frames == []


def test_ticks_per_metre_are_as_good_as_a_radius() -> None:
    ticks = 4096 / math.tau / RADIUS
    rover = Rover(ticks_per_metre=ticks)
    rover.drive(0.15, 0.0, 2.0)
    rover.advance(1.0)
    assert rover.pose.distance(rover.true) < 1e-4
    assert rover.true.x > 0.2


def test_before_the_first_command_its_wheels_have_no_torque_and_standing_it_writes_nothing() -> None:
    rover = Rover()
    rover.command(0.0)
    rover.advance(0.5)
    assert rover.torque == [0, 0]
    rover.drive(0.1, 0.0, 0.5)
    assert rover.torque == [1, 1]
    rover.advance(1.5)
    rover.driver.cycle.bus.write = None  # whoever writes now fails
    rover.advance(1.0)
    assert rover.is_still
    assert rover.bench.component("servos")


def test_without_commands_it_brakes_within_its_limits() -> None:
    rover = Rover(acceleration=0.5)
    rover.drive(0.2, 0.0, 1.0)
    rover.advance(0.38)
    assert rover.speeds[-1] == pytest.approx((0.2, 0.2), abs=UNIT)
    rover.advance(0.25)
    assert 0.02 < rover.speeds[-1][0] < 0.18
    rover.advance(0.5)
    assert rover.is_still


def test_a_timeout_of_zero_is_none() -> None:
    rover = Rover(command_timeout=0.0)
    rover.command(0.1)
    rover.advance(2.5)
    assert not rover.is_still
    rover.command(0.0)
    rover.advance(1.0)
    assert rover.is_still


@settings(max_examples=settings().max_examples // 2)
@given(st.lists(commands, min_size=1, max_size=8))
def test_no_sequence_of_commands_is_too_fast_for_a_wheel(asked: list[tuple[float, float, float]]) -> None:
    rover = Rover(max_speed=0.3, acceleration=0.6, joint={"velocity": 6.0, "acceleration": 20.0})
    for linear, angular, seconds in asked:
        rover.command(linear, angular)
        rover.advance(seconds)
    rover.advance(1.0)
    assert rover.is_still
    speeds = np.array(rover.speeds)
    assert np.abs(speeds).max() <= 6.0 * RADIUS + UNIT
    assert np.abs(np.diff(speeds, axis=0)).max() <= 20.0 * RADIUS * 0.01 + UNIT
    assert np.abs(speeds.mean(axis=1)).max() <= 0.3 + UNIT


@settings(max_examples=settings().max_examples // 2)
@given(st.floats(-0.7, 0.7), st.floats(-2.5, 2.5))
def test_from_rest_to_rest_the_wheels_keep_their_ratio(linear: float, angular: float) -> None:
    rover = Rover(joint={"velocity": 6.0, "acceleration": 20.0})
    rover.drive(linear, angular, 0.6)
    rover.advance(0.8)
    half = angular * DISTANCE / 2
    left, right = linear - half, linear + half
    fastest = max(abs(left), abs(right), 1e-9)
    for value, other in rover.speeds:
        assert abs(value * right - other * left) <= 1.01 * UNIT * fastest


def test_a_command_that_is_no_number_is_refused_with_a_note() -> None:
    rover = Rover()
    rover.controller.received("commands", type("Nan", (), {"linear": _v(x=math.nan), "angular": _v()}))
    rover.advance(0.5)
    assert rover.torque == [0, 0]
    assert rover.controller.note == "a command was refused: nan m/s and 0 rad/s is not a finite velocity"
    rover.drive(0.6, 0.0, 1.2)
    assert rover.controller.note == "commands are cut to its limits"
    assert any("cut to its limits" in status.message for status in rover.statuses)
    rover.command(0.1)
    rover.advance(0.1)
    assert rover.controller.note == ""


def _v(x: float = 0.0, z: float = 0.0) -> Any:
    return type("Vector", (), {"x": x, "z": z})


def test_when_one_wheel_is_mute_the_other_one_stops_too() -> None:
    rover = Rover()
    rover.drive(0.2, 0.0, 1.0)
    mute = rover.driver.cycle.bus.line.servos[0]
    mute.faults.is_mute = True
    for _ in range(8):
        rover.command(0.2)
        rover.advance(0.1)
    assert rover.speeds[-1][1] == 0.0
    assert rover.controller.note.startswith("wheel 'left'")
    mute.faults.is_mute = False
    rover.advance(0.3)
    assert rover.is_still
    rover.drive(0.1, 0.0, 1.0)
    assert rover.speeds[-1] == pytest.approx((0.1, 0.1), abs=UNIT)


def test_a_wheel_in_fault_stops_the_other_one_within_its_limits() -> None:
    rover = Rover()
    rover.drive(0.2, 0.0, 1.0)
    ask(rover, "/left/enable", SetBool, SetBool.Request(data=False))
    begin = len(rover.speeds)
    rover.drive(0.2, 0.0, 0.5)
    right = np.array(rover.speeds[begin:])[:, 1]
    assert np.abs(np.diff(right)).max() <= 0.01 + UNIT
    assert rover.is_still
    assert rover.torque[0] == 0
    assert "disabled" in rover.controller.note


def test_relaxed_wheels_roll_until_the_next_command() -> None:
    rover = Rover()
    rover.drive(0.2, 0.2, 1.0)
    ask(rover, "/servos/relax_all", Trigger, Trigger.Request())
    rover.advance(0.3)
    assert rover.torque == [0, 0]
    before = rover.pose
    for _ in range(20):  # pushed by hand
        rover.servos[0].move_to(rover.servos[0].get("present_position") + 20)
        rover.advance(0.01)
    assert rover.pose.distance(before) > 0.01
    begin = len(rover.speeds)
    rover.drive(0.2, 0.0, 0.5)
    assert rover.torque == [1, 1]
    assert rover.speeds[-1] == pytest.approx((0.2, 0.2), abs=UNIT)
    after = np.array(rover.speeds[begin:])
    assert np.abs(np.diff(after, axis=0)).max() <= 0.01 + UNIT  # from rest


def ask(rover: Rover, topic: str, service: Any, request: Any) -> None:
    rover.bench.bus.client("me", topic, service)(request, lambda reply: None)


def test_a_stop_brakes_within_the_limits_and_nothing_moves_until_the_release() -> None:
    rover = Rover()
    rover.drive(0.2, 0.5, 1.0)
    begin = len(rover.speeds)
    rover.bench.host.stop()
    rover.drive(0.2, 0.5, 0.6)
    speeds = np.array(rover.speeds[begin:])
    assert np.abs(np.diff(speeds, axis=0)).max() <= (1.0 + 3.0 * DISTANCE / 2) * 0.01 + UNIT
    assert rover.is_still
    rover.bench.host.release()
    rover.advance(0.5)
    assert rover.is_still
    rover.drive(0.1, 0.0, 0.5)
    assert not rover.is_still


def test_a_base_that_is_switched_off_brakes_within_its_limits_and_ignores_commands() -> None:
    rover = Rover()
    rover.drive(0.2, 0.0, 1.0)
    rover.driver.switch(SwitchControllers("servos", off=("base",)))
    begin = len(rover.speeds)
    rover.drive(0.2, 0.0, 1.0)
    speeds = np.array(rover.speeds[begin:])
    assert np.abs(np.diff(speeds, axis=0)).max() <= 0.01 + UNIT
    assert rover.is_still
    rover.driver.switch(SwitchControllers("servos", on=("base",)))
    rover.advance(0.3)
    assert rover.is_still
    rover.drive(0.1, 0.0, 0.5)
    assert not rover.is_still


def test_a_lost_command_to_stop_is_repeated() -> None:
    rover = Rover()
    rover.drive(0.2, 0.0, 1.0)
    line = rover.driver.cycle.bus.line
    rover.advance(0.65)
    speed = line[1].get("goal_velocity")
    rover.advance(1.0)
    line.servos[0].set("goal_velocity", speed)  # as if what stops it had been lost
    rover.advance(0.1)
    assert rover.is_still


def test_settings_that_contradict_each_other_are_a_mistake() -> None:
    def mistake(**config: Any) -> str:
        whole = {"left": "a", "right": "b", "wheel_distance": 0.2, "wheel_radius": 0.04, **config}
        field, words = DiffDriveController.mistake(DiffDriveConfig(**whole)) or ("", "")
        return f"{field}: {words}"

    assert mistake() == ": "
    assert mistake(wheel_radius=None).startswith("type: it needs 'wheel_radius'")
    assert mistake(ticks_per_metre=4000.0).startswith("ticks_per_metre: it has")
    assert mistake(right="a") == "right: 'a' is its left and its right wheel"
    assert mistake(odometry={"frame": "odom", "child": "odom"}).startswith("odometry: the frame 'odom'")


def driven(model: str = "XL430-W250") -> Rover:
    """Return a base that has driven along an arc, and stands."""
    rover = Rover(model)
    rover.drive(0.2, 0.4, 4.0)
    rover.command(0.0)
    rover.advance(1.0)
    return rover


def restarted(rover: Rover, *, loses: float | None = None, turns: float = 0.0) -> Rover:
    """Let the driver fail and start again, with its servos where they are, or at `loses` [ticks] as after a power cut.

    Meanwhile the wheels `turn` [ticks].
    """
    ticks = [servo.motor.position for servo in rover.servos]
    rover.bench.host.start()
    rover.bench.host.failed("servos", RuntimeError("planted"))
    rover.told.clear()
    rover.bench.run_until(lambda: rover.bench.host.hosted["servos"].component not in (None, rover.driver), 5.0)
    rover.driver = rover.bench.component("servos")
    for servo, tick, way in zip(rover.servos, ticks, (turns, -turns), strict=True):
        servo.motor.position = (tick + way) if loses is None else loses
    rover.bench.advance(1.0)
    return rover


@pytest.mark.parametrize("model", ["XL430-W250", *rare("MX-28")])
@pytest.mark.parametrize("turns", [0.0, 700.0])
def test_after_a_restart_odometry_goes_on_by_what_the_wheels_have_turned_since(model: str, turns: float) -> None:
    rover = driven(model)
    sure = rover.told[-1].pose.covariance
    before, way = rover.pose, turns * rover.servos[0].model.per_tick * RADIUS
    restarted(rover, turns=turns)
    expected = before.compose(Pose2(way))
    assert rover.pose.distance(expected) < 0.003
    places = [Pose2(told.pose.pose.position.x, told.pose.pose.position.y) for told in rover.told]
    assert max(place.distance(expected) for place in places) < 0.003  # it says nothing before it knows
    assert rover.told[-1].pose.covariance[0] >= 0.9 * sure[0]


def test_after_a_restart_of_driver_and_servos_odometry_goes_on_where_it_was_and_that_is_said() -> None:
    rover = driven()
    before = rover.pose
    restarted(rover, loses=2048.0)
    assert rover.pose.distance(before) < 0.003
    spread = rover.told[-1].pose.covariance.reshape(6, 6)
    assert 0.1 < math.sqrt(spread[0, 0]) < 0.5  # [m]: how far it went until it stood is not known
    assert any("a wheel counts from elsewhere since a restart" in text for text in rover.bench.texts())
    rover.drive(0.2, 0.0, 1.0)
    assert 0.1 < rover.pose.distance(before) < 0.3


def test_other_settings_of_a_bus_leave_the_base_where_it_is() -> None:
    rover = driven()
    before = rover.pose
    rover.bench.host.prepare([instance("servos", "servo_bus", wheels("XL430-W250", max_speed=0.3))])
    rover.bench.host.activate(["servos"])
    rover.told.clear()
    rover.bench.advance(1.0)
    assert rover.pose.distance(before) < 0.003
