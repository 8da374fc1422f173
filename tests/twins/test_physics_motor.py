"""The link between simulated servos and a physics engine: what goes out and comes back is the same joint."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.joint_drive import JointServo, PositionDrive, ServoJoint
from rbxcompose.domains.servos.joint_states import JointPolicy
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.transmission import Gear
from rbxcompose.domains.servos.twins.servo_twin import WINDUP, PhysicsJoints, PhysicsMotor, TwinBus, twin_servos
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Header


class Link:
    """A joint with its servos, the bus that they are on, and their link to an engine."""

    def __init__(self, inverted: list[bool], ratio: float = 1.0, model: str = "XL430-W250") -> None:
        found = servo_models()[model]
        servos = tuple(JointServo(n, found, found.family.centre, turned) for n, turned in enumerate(inverted, 1))
        self.joint = ServoJoint("joint", servos, MotionLimits(), Gear(ratio))
        self.fakes = twin_servos([self.joint], motor=PhysicsMotor)
        self.link, self.now = PhysicsJoints([self.joint], self.fakes), 0.0
        self.bus = TwinBus(self.fakes["joint"], lambda: self.now)

    def feel(self, position: float, effort: float = 0.0) -> None:
        """Let the engine report, and a cycle pass."""
        self.link.feel(JointState(Header(), ("joint",), *np.array([[position], [0.0], [effort]])))
        self.now += 0.01
        self.bus.line.advance()

    @property
    def set_point(self) -> tuple[float, float]:
        """Return where it is to be, and with which part of its most effort."""
        found = self.link.set_points(0)
        return float(found.position[0]), float(found.effort[0])


angles = st.floats(-1.0, 1.0)
inverted = st.lists(st.booleans(), min_size=1, max_size=2)


@given(inverted, st.floats(0.5, 3.0), angles, st.floats(-1.0, 1.0))
def test_servos_measure_what_the_engine_reports(turned: list[bool], ratio: float, at: float, effort: float) -> None:
    link = Link(turned, ratio)
    felt = [link.link.is_felt]
    link.feel(at, effort)
    assert [*felt, link.link.is_felt] == [False, True]
    drive = PositionDrive(link.joint, JointPolicy(0.01))
    for id_, reading in link.bus.read(link.joint.ids, ["present_position", "present_load"]).items():
        drive.take(id_, reading)
    assert drive.measured.position == pytest.approx(at, abs=link.joint.per_tick)
    assert drive.effort == pytest.approx(effort, abs=0.002)


@given(inverted, angles, angles)
def test_without_torque_set_points_are_where_joints_are_and_with_it_where_they_are_to_be(
    turned: list[bool], at: float, goal: float
) -> None:
    link = Link(turned)
    link.feel(at)
    assert link.set_point == pytest.approx((at, 0.0))
    link.bus.write({id_: {"torque_enable": 1} for id_ in link.joint.ids})
    link.bus.write({id_: {"goal_position": raw} for id_, raw in link.joint.raws(goal).items()})
    for _ in range(100):
        link.feel(at)  # something holds it
    assert link.set_point == pytest.approx((goal, 1.0), abs=link.joint.per_tick)


@pytest.mark.parametrize("model", ["XL430-W250", "AX-12"])
def test_a_servo_that_turns_does_not_wind_up_before_what_holds_it(model: str) -> None:
    link = Link([False], model=model)
    link.feel(0.0)
    fake = link.fakes["joint"][0]
    modes = fake.model.family.modes
    wheel = {"operating_mode": modes["velocity"]} if modes else {"min_position": 0, "max_position": 0}
    for values in (wheel, {"torque_enable": 1}, {"goal_velocity": fake.model.to_raw("goal_velocity", 2.0)}):
        link.bus.write({1: values})
    for _ in range(200):
        link.feel(0.0)
    assert link.set_point[0] == pytest.approx(WINDUP, abs=0.05)
    assert math.isclose(float(link.link.set_points(0).velocity[0]), 2.0, rel_tol=0.02)
