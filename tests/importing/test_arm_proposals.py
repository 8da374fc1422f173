"""Arms are proposed for a body that has nothing else, and the robot that is made of them passes `check`."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.arms.drafts import proposed_arms
from tests.body.described import described
from tests.body.kinematics import description_of
from tests.conftest import ROOT
from tests.importing.imports import EXAMPLES
from tests.motion.test_inverse_kinematics import six_joints
from tests.motion.toy_arm import urdf
from tests.shipped import robot_and_plan

LIFTER = (EXAMPLES / "srdf/lifter.urdf").read_text()


def pi_robot() -> str:
    robot, _ = robot_and_plan("pi_robot")
    return described(robot.manifest).text


@pytest.mark.parametrize(
    ("text", "arms"),
    [
        (urdf, {"arm": ("turn", "lift", "bend")}),
        (six_joints, {"j": ("j1", "j2", "j3", "j4", "j5", "j6")}),
        (lambda: LIFTER, {"arm": ("lift", "shoulder", "elbow")}),
    ],
)
def test_a_row_of_joints_is_an_arm_and_fingers_are_not_of_it(text: object, arms: dict[str, tuple[str, ...]]) -> None:
    assert callable(text)
    assert {arm.name: arm.joints for arm in proposed_arms(description_of(text()).body)} == arms


def test_a_head_an_arm_and_its_gripper_are_told_apart() -> None:
    found = {arm.name: arm for arm in proposed_arms(description_of(pi_robot()).body)}
    assert set(found) == {"head", "right_arm"}
    assert len(found["right_arm"].joints) == 6
    assert found["right_arm"].gripper is not None
    assert found["right_arm"].gripper.joint == "right_gripper_finger_joint"


def porter() -> str:
    robot, _ = robot_and_plan("porter")
    return described(robot.manifest).text


@pytest.mark.parametrize(
    ("text", "name"),
    [(urdf, "arm.urdf"), (six_joints, "arm.xacro"), (lambda: LIFTER, "arm.urdf"), (porter, "arm.urdf")],
    ids=["toy", "six", "lifter", "porter"],
)
def test_what_is_proposed_passes_check(
    text: object, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(text)
    (tmp_path / name).write_text(text())
    words = ["arm", "setup", str(tmp_path / name), "--propose", "--out", str(tmp_path / "robot.yaml")]
    assert command.main(words) == 0
    errors = [finding for finding in compile_robot(str(tmp_path), environment={}).report if finding.severity == "error"]
    assert errors == []
    assert ("sliding" in (tmp_path / "robot.yaml").read_text()) is (text is porter)  # whose fingers do
    assert command.main(words) == 1
    assert "already exists" in capsys.readouterr().err


def test_a_body_without_a_row_of_joints_has_no_arm(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["arm", "setup", str(ROOT / "robots/rover/rover.urdf"), "--propose"]) == 1
    assert "RBX9422" in capsys.readouterr().err
