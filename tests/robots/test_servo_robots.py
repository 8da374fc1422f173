"""Robots whose joints are driven: what their parts bring to the bus, and that it follows what is asked."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.compiler import compile_robot
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.qos import Qos
from rbxcompose.testing import Bench
from tests.conftest import ROOT

ARM = ("shoulder_pan", "shoulder_lift", "shoulder_roll", "elbow_flex", "forearm_flex", "wrist_flex")
PI = {"head_pan_joint": 1, "head_tilt_joint": 2} | {f"right_arm_{name}_joint": 3 + n for n, name in enumerate(ARM)}
TICK = 0.00512  # [rad] of an AX-12


def driver(name: str) -> Any:
    plan = compile_robot(str(ROOT / f"robots/{name}"), environment={}).plan
    assert plan
    [found] = [one for one in plan.instances if one.type == "servo_bus"]
    return found


@pytest.mark.parametrize(
    ("name", "ids"), [("pi_robot", PI), ("head_only", {"head_pan_joint": 1, "head_tilt_joint": 2})]
)
def test_one_bus_has_all_joints_of_all_parts(name: str, ids: dict[str, int]) -> None:
    config = driver(name).config
    assert {joint: one.servos[0].id for joint, one in config.joints.items()} == ids
    led = [joint for one in config.controllers.values() for joint in one.config.led]
    assert sorted(led) == sorted(ids)


def test_the_arm_goes_where_it_is_commanded() -> None:
    robot = Bench(driver("pi_robot"), start=False)
    at: dict[str, float] = {}

    def moved(message: JointState) -> None:
        at.update(zip(message.name, map(float, message.position), strict=True))

    robot.bus.subscribe("me", "/joint_states", JointState, Qos.STATE, moved)
    wanted = {"head_pan_joint": 1.0, "right_arm_shoulder_lift_joint": -2.0}
    senders = {name: robot.bus.publisher("me", f"/{name}/command", Float64, Qos.COMMAND) for name in wanted}
    robot.advance(0.2)
    for name, position in wanted.items():
        senders[name](Float64(data=position))
    robot.advance(3.0)
    assert {name: at[name] for name in wanted} == pytest.approx(wanted, abs=TICK)
    assert all(abs(at[name]) < TICK for name in PI.keys() - wanted.keys())
