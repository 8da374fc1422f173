"""A joint and its servo: ticks and angles, limits that hold whatever is asked, and torque only behind a goal."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.joint_drive import JointServo, PositionDrive, ServoJoint
from rbxcompose.domains.servos.joint_states import Enable, JointMode, JointPolicy, MoveTo, Relax
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import model_named, servo_models
from rbxcompose.domains.servos.servo_cycle import ServoCycle
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_twin import TwinBus, pseudo_terminal
from tests.loops import for_all

PERIOD = 0.01
LIMITS = MotionLimits(-1.0, 1.5, 2.0, 10.0)
positions = st.floats(-10, 10) | st.sampled_from([math.nan, math.inf, -math.inf])
requests = positions.map(MoveTo) | st.just(Relax()) | st.booleans().map(Enable)


def joint(model: str = "AX-12", *, is_inverted: bool = False, neutral: int | None = None) -> ServoJoint:
    found = model_named(model)
    assert found
    middle = found.family.centre if neutral is None else neutral
    return ServoJoint("pan", (JointServo(1, found, middle, is_inverted),), LIMITS)


class Driven:
    """One joint on a simulated bus, cycle by cycle."""

    def __init__(self, model: str = "AX-12") -> None:
        self.now = 0.0
        self.drive = PositionDrive(joint(model), JointPolicy(cycle=PERIOD))
        self.bus = TwinBus([FakeServo(model, 1)], lambda: self.now)
        self.cycle = ServoCycle(self.bus, {"pan": self.drive})

    @property
    def servo(self) -> FakeServo:
        return self.bus.line[1]

    @property
    def mode(self) -> str:
        return str(self.drive.mode)

    def run(self, cycles: int = 1) -> None:
        for _ in range(cycles):
            self.cycle.run(self.now, PERIOD)
            self.now += PERIOD


def test_a_joint_with_limits_does_not_turn_without_end() -> None:
    endless = ServoJoint("pan", joint().servos, MotionLimits(velocity=2.0), is_continuous=True)
    for limits, is_endless in ((endless.limits, True), (LIMITS, False)):
        drive = PositionDrive(replace(endless, limits=limits), JointPolicy(cycle=PERIOD))
        assert drive.rules.is_continuous is is_endless


@for_all("name", servo_models())
@pytest.mark.parametrize("is_inverted", [False, True])
def test_each_tick_is_the_tick_of_its_angle(name: str, is_inverted: bool) -> None:
    servo_joint = joint(name, is_inverted=is_inverted, neutral=100)
    family = servo_joint.servo(1).model.family
    first = family.centre - family.ticks // 2
    ticks = range(first, first + family.ticks, max(1, family.ticks // 1000))
    assert all(servo_joint.raws(servo_joint.positions({1: tick})[1]) == {1: tick} for tick in ticks)
    assert (servo_joint.positions({1: 101})[1] < 0) == is_inverted
    assert servo_joint.positions({1: 100}) == {1: 0.0}


def test_a_joint_starts_without_torque_and_moves_from_where_it_is() -> None:
    driven = Driven()
    driven.servo.move_to(600)
    driven.run(5)
    assert driven.servo.get("torque_enable") == 0
    start = driven.drive.measured.position
    driven.drive.ask(MoveTo(start + 0.5))
    driven.run(2)
    assert driven.servo.get("torque_enable") == 1
    assert abs(driven.servo.get("goal_position") - 600) < 5  # not where an old goal was
    driven.run(200)
    assert driven.drive.measured.position == pytest.approx(start + 0.5, abs=driven.drive.per_tick)


@given(asked=st.lists(st.lists(requests, max_size=2), min_size=1, max_size=40), start=st.integers(320, 760))
def test_whatever_is_asked_the_goal_keeps_to_the_limits(asked: list[list[MoveTo | Relax | Enable]], start: int) -> None:
    driven = Driven()
    driven.servo.move_to(start)
    tick = driven.drive.per_tick
    goals: list[float] = []
    for each in asked:
        for request in each:
            driven.drive.ask(request)
        driven.run()
        has_torque = driven.drive.mode in (JointMode.HOLDING, JointMode.ACTIVE)
        goals = [*goals, driven.drive.joint.positions({1: driven.servo.get("goal_position")})[1]] if has_torque else []
        if not driven.drive.condition.is_enabled:
            assert driven.servo.get("torque_enable") == 0
        if len(goals) > 1:
            assert abs(goals[-1] - goals[-2]) <= 2.0 * PERIOD + tick
            outside = (LIMITS.least - tick <= goal <= LIMITS.greatest + tick for goal in goals[-2:])
            assert all(outside) or abs(goals[-1]) <= abs(goals[-2]) + tick  # it was put outside, and moves inwards


def test_the_same_cycle_drives_servos_by_bytes() -> None:
    servo_joint = joint()
    with (
        pseudo_terminal([FakeServo("AX-12", 1)]) as port,
        DynamixelBus(str(port.path), {1: servo_joint.servo(1).model}) as bus,
    ):
        drive = PositionDrive(servo_joint, JointPolicy(cycle=PERIOD))
        cycle = ServoCycle(bus, {"pan": drive})
        begin = time.monotonic()
        while drive.mode is not JointMode.RELAXED and time.monotonic() < begin + 5:
            cycle.run(time.monotonic(), PERIOD)
        drive.ask(MoveTo(0.2))
        while abs(drive.measured.position - 0.2) > servo_joint.per_tick and time.monotonic() < begin + 10:
            cycle.run(time.monotonic(), PERIOD)
        assert drive.measured.position == pytest.approx(0.2, abs=servo_joint.per_tick)
        cycle.end()
        assert bus.read([1], ["torque_enable"])[1].values["torque_enable"] == 0


def test_a_servo_that_is_mute_is_a_fault_and_comes_back_relaxed() -> None:
    driven = Driven()
    driven.run(3)
    driven.drive.ask(MoveTo(1.0))
    driven.run(20)
    driven.bus.line.servos[0].faults.is_mute = True
    driven.run(60)
    assert driven.mode == JointMode.FAULT
    driven.bus.line.servos[0].faults.is_mute = False
    driven.run(3)
    assert driven.mode == JointMode.RELAXED
    assert driven.servo.get("torque_enable") == 0


@pytest.mark.soak  # joints of a whole bus do so in `test_servo_bus_faults`
def test_a_hot_joint_rests_without_torque_until_it_has_cooled_down() -> None:
    driven = Driven()
    driven.run(3)
    driven.drive.ask(MoveTo(0.5))
    driven.run(3)
    driven.servo.motor.temperature = 61
    driven.run(3)
    assert driven.mode == JointMode.RESTING
    assert driven.servo.get("torque_enable") == 0
    driven.servo.motor.temperature = 40
    driven.run(round(60 / PERIOD) + 10)
    assert driven.mode == JointMode.RELAXED


def test_a_joint_is_not_enabled_while_its_servo_still_reports_an_error() -> None:
    driven = Driven("XL430-W250")
    other = PositionDrive(
        ServoJoint("tilt", (replace(driven.drive.joint.servo(1), id=2),), LIMITS), JointPolicy(cycle=PERIOD)
    )
    driven.bus = TwinBus([FakeServo("XL430-W250", id_) for id_ in (1, 2)], lambda: driven.now)
    driven.cycle = ServoCycle(driven.bus, {"pan": driven.drive, "tilt": other})  # errors are read in turns
    driven.run(3)
    driven.servo.load = 2.0
    driven.drive.ask(MoveTo(0.5))
    driven.run(5)
    assert driven.mode == JointMode.FAULT
    driven.servo.load = 0.0
    for _ in range(4):
        driven.drive.ask(Enable(True))
        driven.run()
        assert driven.mode == JointMode.FAULT
    driven.bus.reboot(1)
    driven.run(3)
    driven.drive.ask(Enable(True))
    driven.run(3)
    assert driven.mode == JointMode.RELAXED
