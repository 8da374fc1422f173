"""Servos that refuse velocities and positions beyond limits of their own."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.joint_drive import JointServo, PositionDrive, ServoJoint, VelocityDrive
from rbxcompose.domains.servos.joint_states import JointPolicy, MoveTo
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.servo_cycle import ServoCycle, keep_ranges, keep_speeds
from rbxcompose.domains.servos.transmission import Gear
from rbxcompose.domains.servos.twins.servo_fake import FakeServo, IdealMotor
from rbxcompose.domains.servos.twins.servo_twin import TwinBus, pseudo_terminal

PERIOD = 0.01


def wheel(model: str, ratio: float = 1.0, velocity: float | None = None) -> VelocityDrive:
    found = servo_models()[model]
    servos = (JointServo(1, found, found.family.centre),)
    joint = ServoJoint("wheel", servos, MotionLimits(velocity=velocity), Gear(ratio), True, "velocity")
    return VelocityDrive(joint, JointPolicy(cycle=PERIOD))


def fake(model: str, limit: float) -> FakeServo:
    servo = FakeServo(model, 1)
    servo.set("operating_mode", 1)
    servo.set("velocity_limit", servo.model.to_raw("velocity_limit", limit))
    return servo


@given(
    st.sampled_from(["XL430-W250", "PH54-200"]),
    st.floats(0.5, 6.0),
    st.floats(0.5, 3.0),
    st.floats(-20.0, 20.0),
    st.none() | st.floats(0.1, 10.0),
)
def test_a_wheel_turns_as_fast_as_its_servo_takes_instead_of_not_at_all(
    model: str, limit: float, ratio: float, wanted: float, own: float | None
) -> None:
    servo, drive, now = fake(model, limit), wheel(model, ratio, own), 0.0
    cycle = ServoCycle(TwinBus([servo], lambda: now), {"wheel": drive})
    list(cycle.limit([drive]))
    most = servo.model.to_si("velocity_limit", servo.get("velocity_limit")) / ratio
    assert drive.joint.limits.speed == drive.rules.limits.speed == pytest.approx(min(most, own or math.inf))
    for _ in range(20):
        drive.turn(wanted)
        cycle.run(now, PERIOD)
        now += PERIOD
    reached = servo.model.to_si("goal_velocity", servo.get("goal_velocity")) / ratio
    assert reached == pytest.approx(math.copysign(min(abs(wanted), most, own or math.inf), wanted), abs=0.03)


def test_the_limit_is_read_by_the_sdk_and_told_once() -> None:
    servo, drive = fake("XL430-W250", 2.4), wheel("XL430-W250")
    with pseudo_terminal([servo]) as port, DynamixelBus(str(port.path), {1: servo.model}, timeout=0.05) as bus:
        assert list(keep_speeds(bus, drive)) == ["servo 1 of joint 'wheel' turns at most 2.4 rad/s"]
        assert list(keep_speeds(bus, drive)) == []


def test_protocol_1_and_positions_have_no_such_limit() -> None:
    drive = wheel("AX-12")
    assert list(keep_speeds(TwinBus([FakeServo("AX-12", 1)], lambda: 0.0), drive)) == []
    assert drive.joint.limits.velocity is None


@given(
    st.sampled_from(sorted(servo_models())),
    st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    st.sampled_from([0.5, -2.0]),
    st.booleans(),
    st.floats(-3.0, 3.0),
)
def test_a_joint_goes_as_far_as_its_servo_lets_it(
    model: str, ends: tuple[float, float], ratio: float, is_inverted: bool, wanted: float
) -> None:
    found = servo_models()[model]
    own = JointServo(1, found, found.family.centre, is_inverted)
    joint = ServoJoint("lift", (own,), MotionLimits(-1.0, 1.0), Gear(ratio))
    servo, drive, now = FakeServo(model, 1, motor=IdealMotor), PositionDrive(joint, JointPolicy(cycle=PERIOD)), 0.0
    ticks = sorted(joint.raws(end)[1] for end in ends)
    servo.set("min_position", ticks[0])
    servo.set("max_position", ticks[1])
    cycle = ServoCycle(TwinBus([servo], lambda: now), {"lift": drive})
    list(cycle.limit([drive]))
    assert list(keep_ranges(cycle.bus, drive)) == [] or drive.joint == joint  # where nothing is left, nothing changes
    least, greatest = sorted(joint.transmission.position(own.angle(tick)) for tick in ticks)
    assert drive.joint.limits == drive.rules.limits
    if drive.joint != joint:
        assert (drive.joint.limits.lower, drive.joint.limits.upper) == (max(-1.0, least), min(1.0, greatest))
    for request in (None, MoveTo(wanted), None, None):
        if request is not None:
            drive.ask(request)
        cycle.run(now, PERIOD)
        now += PERIOD
    if drive.joint != joint:
        assert least - joint.per_tick <= drive.commanded.position <= greatest + joint.per_tick


def test_the_range_is_read_by_the_sdk_and_told_once() -> None:
    servo = FakeServo("XL430-W250", 1)
    joint = ServoJoint("lift", (JointServo(1, servo.model, 2048),), MotionLimits(-1.0, 1.0))
    drive = PositionDrive(joint, JointPolicy(cycle=PERIOD))
    with pseudo_terminal([servo]) as port, DynamixelBus(str(port.path), {1: servo.model}, timeout=0.05) as bus:
        assert list(keep_ranges(bus, drive)) == []
        servo.set("max_position", 2300)
        words = "joint 'lift' goes from -3.14 to 0.387 only: servo 1 has min_position 0 and max_position 2300"
        assert list(keep_ranges(bus, drive)) == [words]
        assert list(keep_ranges(bus, drive)) == []
    assert drive.joint.limits.lower == -1.0
    assert drive.joint.limits.upper == pytest.approx(0.387, abs=1e-3)
