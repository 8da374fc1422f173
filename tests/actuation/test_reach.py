"""Where servos can bring their joint, and what they are told before they drive it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.joint_drive import JointServo, ServoJoint
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.servo_cycle import prepare
from rbxcompose.domains.servos.transmission import Calibration, Gear, Measured, Transmission
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_twin import TwinBus

AX = servo_models()["AX-12"]
X = servo_models()["XL430-W250"]
ratios = st.sampled_from([-3.0, -1.0, 0.5, 1.0, 2.5])


def joint(*servos: JointServo, transmission: Transmission | None = None, endless: bool = False) -> ServoJoint:
    return ServoJoint("pan", servos, MotionLimits(), transmission or Gear(), endless)


@given(st.sampled_from(sorted(servo_models())), st.booleans(), ratios, st.floats(-1, 1), st.floats(0, 1))
def test_all_positions_of_the_reach_have_ticks_and_no_others_do(
    name: str, is_inverted: bool, ratio: float, offset: float, part: float
) -> None:
    model = servo_models()[name]
    neutral = model.family.centre + model.family.ticks // 5
    servo_joint = joint(JointServo(1, model, neutral, is_inverted), transmission=Gear(ratio, offset))
    least, greatest = servo_joint.reach
    position = least + part * (greatest - least)
    assert servo_joint.positions(servo_joint.raws(position))[1] == pytest.approx(position, abs=servo_joint.per_tick)
    for beyond, end in ((least - 0.1, least), (greatest + 0.1, greatest)):
        assert servo_joint.positions(servo_joint.raws(beyond))[1] == pytest.approx(end, abs=1e-9)


def test_two_servos_reach_what_both_of_them_reach() -> None:
    least, greatest = joint(JointServo(1, AX, 512), JointServo(2, AX, 0)).reach
    assert (least, math.degrees(greatest)) == pytest.approx((0.0, 149.707), abs=1e-3)


def test_the_reach_of_a_table_is_that_of_its_ends() -> None:
    table = Measured(Calibration(((-1.0, 0.4), (1.0, 0.1))))
    assert joint(JointServo(1, AX, 512), transmission=table).reach == (0.1, 0.4)
    longer = Measured(Calibration(((0.0, 0.0), (10 * math.pi, 0.4))))
    assert joint(JointServo(1, X, 2048), transmission=longer).reach == pytest.approx((0.0, 0.04), abs=1e-4)


def test_only_some_models_turn_without_end() -> None:
    assert joint(JointServo(1, X, 2048), endless=True).reach == (-math.inf, math.inf)
    for name in ("AX-12", "MX-28", "XL-320"):
        model = servo_models()[name]
        least, greatest = joint(JointServo(1, model, model.family.centre), endless=True).reach
        assert greatest - least < model.family.span


def test_the_delay_of_replies_is_written_where_it_is_wanted_and_differs() -> None:
    bus = TwinBus([FakeServo("AX-12", 1), FakeServo("XL430-W250", 2)], lambda: 0.0)
    bus.line[2].set("return_delay", 0)
    joints = [joint(JointServo(1, AX, 512)), joint(JointServo(2, X, 2048))]
    assert list(prepare(bus, joints, 0.0)) == []
    assert list(prepare(bus, joints, 0.0, 0.0)) == ["servo 1 of joint 'pan' now has return_delay 0"]
    assert [servo.get("return_delay") for servo in bus.line.servos] == [0, 0]
    assert list(prepare(bus, joints, 0.0, 0.0)) == []
