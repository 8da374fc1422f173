"""Arms hold, sag and grip in MuJoCo with no more torque than their servos have."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rbxcompose.base.geometry import Pose2, Vector3
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld, UnstablePhysicsError
from rbxcompose.domains.worlds.shapes import WorldBox, WorldShape
from tests.worlds.physical import STEP, contacts, empty, shipped, target

LIFT, ARM = "right_arm_shoulder_lift_joint", "right_arm"
FINGER, TORSO, GRASP = "right_gripper_left_finger_joint", "torso_joint", "right_gripper_grasp"
STRETCHED = {LIFT: -math.pi / 2}
OPEN = {FINGER: 0.05, TORSO: 0.1}
SIDE = 0.04


def with_box(mass: float = 0.3) -> PhysicsWorld:
    """Return a porter whose open gripper is around a box on a table."""
    robot = shipped("porter", positions=OPEN)
    x, y, z = PhysicsWorld(robot, empty(robot)).pose_of(GRASP).translation
    table = WorldShape("table", WorldBox((0.4, 0.8, 0.02)), Pose2(x + 0.15, y), z - 0.08)
    box = WorldShape("box", WorldBox((SIDE, SIDE, 0.12)), Pose2(x, y), z - 0.06)
    return PhysicsWorld(robot, empty(robot, table, box), {"box": mass})


def above_hand(physics: PhysicsWorld) -> Vector3:
    """Return where the box is in the frame of the hand."""
    return physics.pose_of(GRASP).inverse().apply(physics.shape_pose("box").translation)


def test_an_arm_holds_its_pose_and_sags_more_with_less_torque() -> None:
    sags = []
    for effort in (1.5, 0.9, 0.0):
        robot = shipped("pi_robot", positions=STRETCHED)
        physics = PhysicsWorld(robot, empty(robot))
        physics.limit(LIFT, effort)
        physics.step(1.2)
        sags.append(physics.position(LIFT) - STRETCHED[LIFT])
        assert abs(physics.effort(LIFT)) <= effort
    assert 0 < sags[0] < math.radians(3)
    assert sags == sorted(sags)
    assert sags[-1] > math.radians(60)


def test_a_servo_that_had_let_go_holds_its_joint_where_it_is() -> None:
    robot = shipped("pi_robot", positions=STRETCHED)
    physics = PhysicsWorld(robot, empty(robot))
    physics.limit(LIFT, 0.0)
    physics.step(1.0)
    fallen = physics.position(LIFT)
    target(physics, LIFT, STRETCHED[LIFT])
    physics.limit(LIFT, 1.5)
    physics.step(1.0)
    assert physics.position(LIFT) == pytest.approx(fallen, abs=math.radians(3))
    assert abs(physics.velocity(LIFT)) < 0.01


def test_a_servo_moves_as_fast_as_it_can_and_no_further_than_its_limits() -> None:
    robot = shipped("pi_robot")
    physics = PhysicsWorld(robot, empty(robot))
    limits = robot.body.joints["head_pan_joint"].limits
    assert limits is not None
    assert limits.velocity is not None
    assert limits.upper is not None
    target(physics, "head_pan_joint", 9.0)
    fastest = 0.0
    while physics.time < limits.upper / limits.velocity + 0.5:
        physics.step(STEP)
        fastest = max(fastest, physics.velocity("head_pan_joint"))
    assert fastest == pytest.approx(limits.velocity, rel=0.1)
    assert physics.position("head_pan_joint") == pytest.approx(limits.upper, abs=0.01)


def test_a_gripper_feels_what_it_closes_on() -> None:
    robot = shipped("porter", positions=OPEN)
    free, full = PhysicsWorld(robot, empty(robot)), with_box()
    for physics in (free, full):
        target(physics, FINGER, 0.0)
        physics.step(1.2)
    assert free.position(FINGER) == pytest.approx(0.0, abs=2e-3)
    assert abs(free.effort(FINGER)) < 5.0
    assert full.position(FINGER) == pytest.approx(SIDE / 2, abs=2e-3)
    assert full.effort(FINGER) == pytest.approx(-60.0)
    assert full.velocity(FINGER) == pytest.approx(0.0, abs=1e-4)
    holding = [touch for touch in contacts(full) if touch.what == "box"]
    assert {touch.link for touch in holding} == {"right_gripper_left_finger_link", "right_gripper_right_finger_link"}
    assert sum(touch.force for touch in holding) == pytest.approx(60.0, rel=0.1)


def test_a_box_is_gripped_lifted_carried_and_let_go() -> None:
    physics = with_box()
    began = physics.shape_pose("box").translation
    target(physics, FINGER, 0.0)
    physics.step(1.2)
    target(physics, TORSO, 0.3)
    physics.step(3.0)
    lifted = physics.shape_pose("box").translation
    assert lifted[2] - began[2] == pytest.approx(0.2, abs=0.01)
    held = above_hand(physics)
    for done in range(100):
        physics.drive(0.2 * min(1.0, done / 50), 0.0)
        physics.step(STEP)
    assert above_hand(physics) == pytest.approx(held, abs=2e-3)
    assert physics.base_pose.x > 0.2
    target(physics, FINGER, 0.05)
    physics.step(1.2)
    assert physics.shape_pose("box").translation[2] < 0.2


def test_a_box_that_is_too_heavy_is_not_lifted() -> None:
    physics = with_box(mass=20.0)
    target(physics, FINGER, 0.0)
    physics.step(1.2)
    target(physics, TORSO, 0.3)
    physics.step(3.0)
    assert physics.position(TORSO) > 0.29
    assert physics.shape_pose("box").translation[2] < physics.pose_of(GRASP).translation[2] - 0.15


def test_an_unstable_state_is_an_error_and_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = shipped("porter")
    monkeypatch.chdir(tmp_path)
    physics = PhysicsWorld(robot, empty(robot), timestep=0.5)
    physics.drive(1.0, 1.0)
    with pytest.raises(UnstablePhysicsError, match=r"'porter' at .* s: mjWARN_BADQACC"):
        physics.step(60.0)
    assert list(tmp_path.iterdir()) == []
