"""`arm setup`: what it writes is what the robot then uses."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.compiler.compile import compile_robot
from tests.conftest import ROOT

FILE = "pairs.yaml"
ROBOT = f"""\
rbx: 1
kind: Robot
name: reacher
body: {{collisions: {FILE}}}
buses: {{servos: {{type: dynamixel}}}}
include:
  arm: {{part: "rbx:parts/servo_arm.yaml", with: {{bus: servos}}}}
"""
FOLDED = """\
arms:
  arm:
    poses:
      folded: {arm_shoulder_pan_joint: -140 deg, arm_shoulder_lift_joint: 146 deg, arm_shoulder_roll_joint: 50 deg}
"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "robots/reacher/robot.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(ROBOT)
    return path


def setup(robot: Path, *words: str) -> int:
    return command.main(["arm", "setup", str(robot), "--samples", "200", *words])


def test_the_file_that_it_writes_is_used_and_is_the_same_again(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert [finding.code for finding in compile_robot(str(robot), environment={}).report] == ["RBX2307"]
    assert setup(robot) == 0
    written = robot.with_name(FILE).read_text()
    assert capsys.readouterr().out.startswith("wrote ")
    assert list(compile_robot(str(robot), environment={}).report) == []
    assert setup(robot, "--json") == 0
    assert robot.with_name(FILE).read_text() == written
    told = json.loads(capsys.readouterr().out)
    assert (told["samples"], told["seed"]) == (200, 1)
    assert len(told["pairs"]) == written.count("\n- ")


def test_what_a_person_wrote_stays(robot: Path) -> None:
    assert setup(robot) == 0
    file = robot.with_name(FILE)
    text = file.read_text()
    line = next(candidate for candidate in text.splitlines() if candidate.endswith("never]"))
    file.write_text(text.replace(line, line.replace("never]", "user]")))
    assert setup(robot) == 0
    assert line.replace("never]", "user]") in file.read_text()


def test_links_that_touch_at_rest_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("robots/pedestal_pi", "missions"):
        shutil.copytree(ROOT / name, tmp_path / name)
    column = tmp_path / "robots/pedestal_pi/pedestal.urdf.xacro"
    column.write_text(column.read_text(encoding="utf-8").replace('radius="0.03"', 'radius="0.05"'), encoding="utf-8")
    assert setup(column.parent, "--out", str(tmp_path / "pairs.yaml")) == 0
    told = capsys.readouterr()
    assert "pedestal_link - right_gripper_link" in told.err
    assert "body:\n  collisions: " in told.out


def test_a_profile_has_a_file_of_its_own(robot: Path) -> None:
    robot.write_text(f"{ROBOT}profiles: {{more: {{}}}}\n")
    assert setup(robot, "--profile", "more") == 0
    assert robot.with_name("reacher.more.collisions.yaml").is_file()


def test_too_few_positions_and_robots_of_the_library_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command.main(["arm", "setup", "rbx:robots/pi_robot", "--samples", "0"])
    assert command.main(["arm", "setup", "rbx:robots/pi_robot"]) == 1
    assert "'--out'" in capsys.readouterr().err


def test_no_other_file_is_replaced(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = str(shutil.copy(robot, robot.with_name("copy.yaml")))
    assert setup(robot, "--out", copy) == 1
    assert "not replaced" in capsys.readouterr().err
    assert Path(copy).read_text() == ROBOT


def test_a_robot_without_a_body_has_nothing_to_set_up(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text("rbx: 1\nkind: Robot\nname: ghost\n")
    assert setup(path) == 1
    assert "RBX9420" in capsys.readouterr().err


def test_poses_that_collide_are_told_at_their_lines(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert setup(robot, "--check") == 0
    assert "none of them in collision" in capsys.readouterr().out
    robot.write_text(ROBOT + FOLDED)
    assert setup(robot, "--check") == 1
    told = capsys.readouterr().err
    assert "RBX9423" in told
    assert "robot.yaml:11:" in told


def test_a_pair_that_is_left_out_and_collides_in_a_pose_is_told(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot.write_text(ROBOT + FOLDED)
    assert setup(robot) == 0
    assert setup(robot, "--check", "--json") == 1
    captured = capsys.readouterr().out
    [found] = json.loads(captured[captured.index("[{") :])
    file = robot.with_name(FILE)
    lines = "".join(f"- [{one}, {other}, user]\n" for one, other in found["pairs"])
    file.write_text(file.read_text() + lines)
    assert setup(robot, "--check") == 0
    told = capsys.readouterr().err
    assert "RBX9424" in told
    assert "'user'" in told
