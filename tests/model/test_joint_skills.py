"""Controllers as skills: their joints are the arguments, with the dimensions that the body gives them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.expressions.types import TYPES
from rbxcompose.commands import main as command
from rbxcompose.missions.sources import SkillWay
from rbxcompose.testing.manifests import Checked, check_text
from rbxcompose.tools.lsp.answers import describe
from rbxcompose.tools.lsp.document import Document

LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="2"/>'
BODY = f"""<robot name="head">
  <link name="base"/>
  <link name="column"/>
  <link name="face"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="column"/><axis xyz="0 0 1"/>{LIMIT}</joint>
  <joint name="pan" type="revolute"><parent link="column"/><child link="face"/><axis xyz="0 0 1"/>{LIMIT}</joint>
</robot>
"""
SERVOS = """body: {urdf: head.urdf}
actuators:
  lift_servo: {bus: servos, model: AX-12, id: 1}
  pan_servo: {bus: servos, model: AX-12, id: 2}
joints:
  lift: {actuator: lift_servo, travel: 3 m, limits: {acceleration: 1 m/s^2}}
  pan: {actuator: pan_servo, limits: {acceleration: 360 deg/s^2}}
controllers:
  head: {type: joint_trajectory, joints: [lift, pan]}
"""
BUS = "buses: {servos: {type: dynamixel}}\n"
ROBOT = f"rbx: 1\nkind: Robot\nname: one\n{BUS}{SERVOS}missions: {{nod: nod.yaml}}\n"
MISSION = "rbx: 1\nkind: Mission\nname: nod\ninputs: {angle: {type: angle, default: 20 deg}}\ndo:\n  - head: "


def checked(folder: Path, arguments: str, robot: str = ROBOT) -> Checked:
    return check_text(robot, folder, others={"head.urdf": BODY, "nod.yaml": f"{MISSION}{arguments}\n"})


def told(capsys: pytest.CaptureFixture[str], *words: str) -> Any:
    assert command.main([*words]) == 0
    return json.loads(capsys.readouterr().out)


def test_turning_joints_are_angles_and_sliding_ones_lengths(tmp_path: Path) -> None:
    found = checked(tmp_path, "{lift: 3 cm, pan: $angle - 5 deg, duration: 2 s}")
    assert not found.codes, found.text
    assert found.compilation.robot
    head = found.compilation.robot.skills["head"]
    assert head.skill.arguments == {"lift": TYPES["length"], "pan": TYPES["angle"], "duration": TYPES["time"]}
    assert (head.way, head.topic, head.skill.claims) == (SkillWay.ACTION, "/head/move", "head")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("{lift: 3 deg}", "this must be a length; it is an angle"),
        ("{pan: 3 m}", "this must be an angle; it is a length"),
        ("{pna: 3 deg}", "did you mean 'pan'?"),
        ("{}", "needs at least one of lift, pan"),
        ("{duration: 1 s}", "needs at least one of lift, pan"),
        ("3 deg", "takes no single value"),
    ],
)
def test_wrong_arguments_are_told(arguments: str, words: str, tmp_path: Path) -> None:
    found = checked(tmp_path, arguments)
    assert found.codes == ["RBX4105"]
    assert words in found.text


def test_trajectories_are_no_skill_so_two_controllers_have_nothing_in_common(tmp_path: Path) -> None:
    two = ROBOT.replace("joints: [lift, pan]}\n", "joints: [lift]}\n  face: {type: joint_trajectory, joints: [pan]}\n")
    found = checked(tmp_path, "{lift: $angle * 3 cm / 1 rad}", two)
    assert not found.codes, found.text
    assert found.compilation.robot
    assert {"head", "face"} <= set(found.compilation.robot.skills)
    assert "follow_joint_trajectory" not in found.compilation.robot.skills


@pytest.mark.parametrize(("skill", "codes"), [("head", []), ("follow_joint_trajectory", ["RBX3022"])])
def test_a_part_may_promise_one(skill: str, codes: list[str], tmp_path: Path) -> None:
    part = f"rbx: 1\nkind: Part\nname: neck\nprovides:\n  skills: [{skill}]\n{BUS}{SERVOS}"
    robot = "rbx: 1\nkind: Robot\nname: one\ninclude: {neck: neck.yaml}\n"
    found = check_text(robot, tmp_path, others={"neck.yaml": part, "head.urdf": BODY})
    assert found.codes == codes, found.text


def test_it_is_listed_with_an_example(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    checked(tmp_path, "{lift: 3 cm}")
    [head] = [entry for entry in told(capsys, "mission", "skills", str(tmp_path), "--json") if entry["name"] == "head"]
    assert [
        (argument["name"], argument["type"], argument["needed"], argument["main"]) for argument in head["arguments"]
    ] == [("lift", "a length", False, False), ("pan", "an angle", False, False), ("duration", "a time", False, False)]
    command.main(["mission", "skills", str(tmp_path)])
    assert "- head: {lift: 0.5 m}\n" in capsys.readouterr().out


def test_an_editor_tells_what_a_joint_takes(tmp_path: Path) -> None:
    found = checked(tmp_path, "{pan: 3 deg}")
    file = tmp_path / "nod.yaml"
    text = file.read_text(encoding="utf-8")
    line = text.splitlines()[-1]
    document = Document(file, text, found.compilation.robot)
    assert describe(document, text.count("\n") - 1, line.index("pan")) == "Argument of `head`: an angle."


TRIAL = "rbx: 1\nkind: Test\nname: t\nrobot: robot.yaml\nmission: nod\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("expect:\n  steps:\n    - head: 3 deg\n", "the skill 'head' takes no single value"),
        ("mocks:\n  head:\n    fails_for: [3 deg]\nexpect:\n  outcome: success\n", "'head' takes no single value"),
    ],
)
def test_a_test_of_a_mission_names_joints_too(
    text: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    checked(tmp_path, "{pan: 3 deg}")
    (tmp_path / "t.test.yaml").write_text(TRIAL + text, encoding="utf-8")
    assert command.main(["test", str(tmp_path / "t.test.yaml")]) == 1
    assert words in capsys.readouterr().err
