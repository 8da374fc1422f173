"""Robots whose joints are driven: what their parts bring to the bus, and that it follows what is asked."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.compiler.compile import Compilation
from rbxcompose.domains.servos.controllers.gripper import model_of
from rbxcompose.msgs.rbxcompose_msgs import Grip
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.sdk.bound import Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.body.described import described
from tests.conftest import ROOT
from tests.shipped import compiled
from tests.soak import rare

ARM = ("shoulder_pan", "shoulder_lift", "shoulder_roll", "elbow_flex", "forearm_flex", "wrist_flex")
ROLLING = ("shoulder_pan", "shoulder_lift", "upperarm_roll", "elbow_flex", "forearm_roll", "wrist_flex", "wrist_roll")
HEAD = {"head_pan_joint": 1, "head_tilt_joint": 2}
PI = HEAD | {f"right_arm_{name}_joint": 3 + n for n, name in enumerate(ARM)} | {"right_gripper_finger_joint": 9}
LEFT = {f"left_arm_{name}_joint": 10 + n for n, name in enumerate(ARM)} | {"left_gripper_finger_joint": 16}
PORTER = (
    {"torso_joint": 1, "head_pan_joint": 2, "head_tilt_joint": 3}
    | {f"right_arm_{name}_joint": 4 + n for n, name in enumerate(ROLLING)}
    | {"right_gripper_left_finger_joint": 11}
)
FLAT = 0.006  # thickness of a finger [m]
TICK = 0.00512  # [rad] of an AX-12


def made(name: str, *profiles: str) -> Compilation:
    return compiled(str(ROOT / f"robots/{name}"), profiles=profiles, environment={})


def driver(name: str, profile: str = "") -> Any:
    profiles = [profile] if profile else []
    plan = made(name, *profiles).plan
    assert plan
    [found] = [instance for instance in plan.instances if instance.type == "servo_bus"]
    return found


@pytest.mark.parametrize(
    ("name", "profile", "ids"),
    [
        ("pi_robot", "", PI),
        ("head_only", "", HEAD),
        ("pedestal_pi", "no_gripper", {name: id_ for name, id_ in PI.items() if id_ != 9}),
        *(
            pytest.param(*values, marks=pytest.mark.soak)
            for values in (
                ("pedestal_pi", "", PI),
                ("pedestal_pi", "head_only", HEAD),
                ("box_robot", "two_arms", PI | LEFT),
                ("box_robot", "pan_tilt_head", HEAD),
                ("box_robot", "telescoping", PI),
                ("porter", "", PORTER),
            )
        ),
    ],
)
def test_one_bus_has_all_joints_of_all_parts(name: str, profile: str, ids: dict[str, int]) -> None:
    config = driver(name, profile).config
    assert {joint: one.servos[0].id for joint, one in config.joints.items()} == ids
    led = [joint for controller in config.controllers.values() for joint in controller.config.claimed]
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


@pytest.mark.parametrize("name", ["pi_robot", *rare("pedestal_pi")])
def test_the_gripper_opens_its_tips_as_far_as_it_is_told(name: str) -> None:
    robot = made(name).robot
    assert robot
    body = described(robot.manifest).body
    model = model_of(driver(name).config.controllers["right_gripper_controller"].config)
    for opening in (0.0, 0.04, 0.08, 0.11):
        poses = body.poses({"right_gripper_finger_joint": model.angles(opening)[0]})
        palm = poses["right_gripper_link"].inverse()
        tip = palm.compose(poses["right_gripper_finger_link"]).apply((0.1, 0.0, 0.0))
        still = palm.compose(poses["right_gripper_static_finger_link"]).translation
        assert abs(tip[1] - still[1]) - FLAT == pytest.approx(opening, abs=0.001)


@pytest.mark.parametrize("name", ["pi_robot", *rare("pedestal_pi")])
def test_the_gripper_holds_what_is_between_its_fingers(name: str) -> None:
    robot = Bench(driver(name))
    ends: list[Any] = []
    send = robot.bus.action_client("me", "/right_gripper_controller/grip", Grip)
    robot.advance(0.2)
    send(Grip.Goal(opening=0.1), ends.append)
    robot.advance(2.0)
    send(Grip.Goal(opening=0.0), ends.append)
    robot.advance(0.3)
    servos: Any = robot.component("servos")
    servos.cycle.bus.line[9].faults.is_jammed = True
    robot.advance(2.0)
    assert [end.outcome for end in ends] == [Outcome.SUCCEEDED] * 2
    assert (ends[0].result.reached, ends[1].result.stalled) == (True, True)
    assert 0.02 < ends[1].result.opening < 0.1
