"""Arms of a manifest: what they become, how parts name them, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.parts.project import Project

ROBOT = """
buses: {servos: {type: dynamixel}}
include:
  right_arm: {part: "rbx:parts/servo_arm.yaml", with: {bus: servos}}
"""


def arm_of(project: Project) -> Any:
    assert project.checked
    [found] = [one for one in project.checked.plan.instances if one.type == "arm"]
    return found


def test_an_arm_of_a_part_has_the_name_of_the_instance_if_that_ends_with_it(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT)
    assert project.findings == []
    assert arm_of(project).name == "right_arm"
    project.check(ROBOT.replace("right_arm:", "manipulator:"))
    assert arm_of(project).name == "manipulator_arm"


def test_an_arm_has_the_joints_of_its_chain_with_their_tighter_limits(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT)
    config = arm_of(project).config
    assert next(iter(config.joints)) == "right_arm_shoulder_pan_joint"
    assert len(config.joints) == 6
    assert config.follow == "right_arm_controller/follow_joint_trajectory"
    pan = config.joints["right_arm_shoulder_pan_joint"]
    assert (pan.lower, pan.upper) == pytest.approx((-2.6005, 2.6005), abs=1e-3)
    assert (pan.velocity, pan.acceleration) == pytest.approx((1.5708, 6.2832), abs=1e-4)
    assert config.poses["straight_forward"]["right_arm_shoulder_lift_joint"] == pytest.approx(-1.5708, abs=1e-4)


def test_a_robot_changes_the_arm_of_its_part(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(
        ROBOT + "arms: {right_arm: {planner: {time: 2 s}, poses: {down: {right_arm_elbow_flex_joint: 0 deg}}}}\n"
    )
    assert project.findings == []
    config = arm_of(project).config
    assert config.planner.time == 2.0
    assert set(config.poses) == {"resting", "straight_forward", "wave", "down"}


def test_a_pose_that_does_not_exist_is_a_finding_of_the_mission(tmp_path: Path) -> None:
    project = Project(tmp_path)
    mission = "rbx: 1\nkind: Mission\nname: go\ndo: {move_right_arm: restng}\n"
    checked = project.check(ROBOT + "missions: {go: ../../go.yaml}\n", files={"go.yaml": mission})
    assert checked.codes == ["RBX4105"] or checked.codes == ["RBX4104"], checked.text
    assert "resting" in checked.text


def test_both_a_chain_and_joints_are_too_much(tmp_path: Path) -> None:
    project = Project(tmp_path)
    checked = project.check(ROBOT + "arms: {right_arm: {joints: [right_arm_elbow_flex_joint]}}\n")
    assert "either 'chain' or 'joints'" in checked.text
