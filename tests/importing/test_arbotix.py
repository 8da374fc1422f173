"""Files of ArbotiX become robots: what they say is written with its place, what is lost is told."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rbxcompose.domains.servos.controllers.gripper import GripperConfig, GripperController, model_of
from rbxcompose.testing import check_text
from rbxcompose.testing.golden import Golden
from tests.importing.imports import FILES, import_files, import_texts

GOLDEN = {"head": ["head"], "arm": ["head", "arm", "hand"], "base": ["base"]}
URDF = """<robot name="tried">
  <link name="base_footprint"/>
{joints}
</robot>
"""
JOINT = """  <link name="{name}_link"/>
  <joint name="{name}" type="revolute">
    <parent link="base_footprint"/><child link="{name}_link"/><limit lower="-3" upper="3" effort="1" velocity="2"/>
  </joint>"""
WITH_JOINT = "joints: {pan: {id: 1}}\n"


@pytest.mark.parametrize("name", GOLDEN)
def test_what_is_written_and_what_is_told(name: str, repository: Path, golden: Golden) -> None:
    found = import_files([FILES / f"{text}.yaml" for text in GOLDEN[name]], name)
    golden.check(f"{name}.yaml", found.text)
    golden.check(f"{name}.txt", found.words)
    assert import_files([FILES / f"{text}.yaml" for text in GOLDEN[name]], name).text == found.text


@pytest.mark.parametrize("name", GOLDEN)
def test_with_a_body_the_robot_has_no_mistake(name: str, repository: Path, tmp_path: Path) -> None:
    found = import_files([FILES / f"{one}.yaml" for one in GOLDEN[name]], name)
    text = found.text.replace("# body:", "body:")
    joints = "\n".join(JOINT.format(name=joint) for joint in found.data.get("joints", {}))
    checked = check_text(text, tmp_path, others={"robot.urdf": URDF.format(joints=joints)})
    assert checked.plan.robot == name


def test_files_for_different_ports_make_two_buses(tmp_path: Path) -> None:
    left = "port: /dev/left\nbaud: 57600\njoints: {left: {id: 1}}\n"
    found = import_texts(
        tmp_path, left, "port: /dev/right\njoints: {right: {id: 1}}\n", "joints: {also_left: {id: 2}}\n"
    )
    buses = found.data["buses"]
    assert [(bus["port"], bus.get("baud")) for bus in buses.values()] == [("/dev/left", 57600), ("/dev/right", None)]
    servos = {name: actuator["bus"] for name, actuator in found.data["actuators"].items()}
    assert servos == {"left_servo": "servos", "right_servo": "servos_2", "also_left_servo": "servos"}


def test_what_files_agree_about_is_written_once(tmp_path: Path) -> None:
    found = import_texts(tmp_path, WITH_JOINT, f"\n{WITH_JOINT}")
    assert list(found.data["joints"]) == ["pan"]
    assert "RBX2232" not in found.words


def test_of_what_they_disagree_about_the_first_counts(tmp_path: Path) -> None:
    found = import_texts(tmp_path, f"baud: 57600\n{WITH_JOINT}", "baud: 9600\njoints: {pan: {id: 2}}\n")
    assert found.told.count(("RBX2232", 1)) == 1
    assert found.told.count(("RBX2232", 2)) == 1
    assert found.data["buses"]["servos"]["baud"] == 57600
    assert found.data["actuators"]["pan_servo"]["id"] == 1


def test_parameters_below_the_names_of_programs_are_found(tmp_path: Path) -> None:
    text = "arbotix:\n  joints: {finger: {id: 1}}\nhand:\n  model: parallel\n  joint: finger\n  scale: -12.5\n"
    found = import_texts(tmp_path, text)
    assert list(found.data["joints"]) == ["finger"]
    hand = {"type": "gripper", "model": "parallel", "joint": "finger", "travel": "0.5026548 m", "invert": True}
    assert found.data["controllers"] == {"hand": hand}
    settings = GripperConfig.model_validate(hand | {"opening": ["0 mm", "50 mm"]})
    assert GripperController.mistake(settings) is None
    assert model_of(settings).angles(0.02) == pytest.approx((-12.5 * 0.02,), rel=1e-6)


def test_a_file_of_gripper_parameters_gives_the_gripper_its_name(tmp_path: Path) -> None:
    text = "model: dualservo\ncenter_left: 0.3\ninvert_right: yes\njoint_left: a\njoint_right: b\nmax_opening: 0.04\n"
    found = import_texts(tmp_path, "joints: {a: {id: 1}, b: {id: 2}}\n", text)
    hand = found.data["controllers"]["file_2"]
    assert hand == {
        "type": "gripper",
        "model": "dual",
        "left": "a",
        "right": "b",
        "pad_width": "10 mm",
        "finger_length": "20 mm",
        "opening": ["0 mm", "40 mm"],
        "center_left": "0.3 rad",
        "invert_right": True,
    }
    settings = GripperConfig.model_validate(hand)
    assert GripperController.mistake(settings) is None
    angle = math.asin((0.03 - 0.01) / (2 * 0.02))
    assert model_of(settings).angles(0.03) == pytest.approx((angle + 0.3, angle))


@pytest.mark.parametrize("given", ["min_opening: -0.8, max_opening: 0.5", "max_opening: 0.5", "min_opening: 0.09"])
def test_angles_given_as_openings_are_left_out(given: str, tmp_path: Path) -> None:
    text = f"joints: {{finger: {{id: 1}}}}\nhand: {{model: singlesided, joint: finger, {given}}}\n"
    found = import_texts(tmp_path, text)
    assert ("RBX2237", 2) in found.told
    assert "opening" not in found.data["controllers"]["hand"]


def test_names_that_manifests_cannot_have_are_changed_and_joints_keep_theirs(tmp_path: Path) -> None:
    text = 'joints: {"Pan-1_joint": {id: 1}, "pan 1_joint": {id: 2}, "é: $x": {id: 3}}\n'
    follow = "controllers: {Head-Ctl: {type: follow_controller, joints: [Pan-1_joint, 'é: $x']}}\n"
    found = import_texts(tmp_path, text + follow)
    assert list(found.data["joints"]) == ["Pan-1_joint", "pan 1_joint", "é: $x"]
    assert list(found.data["actuators"]) == ["pan_1_servo", "pan_1_servo_2", "x_servo"]
    assert found.data["controllers"]["head_ctl"]["joints"] == ["Pan-1_joint", "é: $$x"]
    assert "its name was 'Head-Ctl'" in found.text
