"""Wheels whose servos refuse velocities above a limit of their own."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.joint_drive import JointServo, ServoJoint, VelocityDrive
from rbxcompose.domains.servos.joint_states import JointPolicy
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.servo_cycle import ServoCycle, keep_speeds
from rbxcompose.domains.servos.transmission import Gear
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
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
