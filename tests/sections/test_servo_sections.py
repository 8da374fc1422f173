"""Buses, actuators, joints and controllers of a manifest: what they become, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_text
from tests.loops import for_all

LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="2"/>'
BODY = f"""<robot name="head">
  <link name="base"/>
  <link name="neck"/>
  <link name="face"/>
  <joint name="pan_joint" type="revolute"><parent link="base"/><child link="neck"/><axis xyz="0 0 1"/>{LIMIT}</joint>
  <joint name="tilt_joint" type="revolute"><parent link="neck"/><child link="face"/><axis xyz="0 1 0"/>{LIMIT}</joint>
</robot>
"""
HEAD = "rbx: 1\nkind: Robot\nname: head\nbody: {urdf: head.urdf}\n"
SERVOS = """buses:
  servos: {type: dynamixel, rate: 50 Hz}
actuators:
  pan: {bus: servos, model: AX-12, id: 1, neutral: 500}
  tilt: {bus: servos, model: XL430-W250, id: 2, invert: true}
joints:
  pan_joint:
    actuator: pan
    limits: {position: [-50 deg, 30 deg], velocity: 60 deg/s}
  tilt_joint: {actuator: tilt}
controllers:
  head: {type: joint_trajectory, joints: [pan_joint, tilt_joint]}
"""
PART = """rbx: 1
kind: Part
name: head
args:
  id: {type: count, default: 1}
body: {urdf: head.urdf}
actuators:
  pan: {bus: servos, model: AX-12, id: "${args.id}"}
joints:
  pan_joint: {actuator: pan}
controllers:
  look: {type: joint_trajectory, joints: [pan_joint]}
"""
WRONG = {
    "mistakes of two joints": SERVOS.replace("velocity: 60 deg/s", "velocity: 60").replace(
        "{actuator: tilt}", "{actuator: tilt, ratio: x}"
    ),
    "no word for the type of a controller": SERVOS.replace("type: joint_trajectory", "type: [joint_trajectory]"),
    "a fault of a joint with a mistake": SERVOS.replace("{actuator: tilt}", "{actuator: tilt, ratio: x}")
    + "faults:\n  one: {at: 1 s, fault: mute, joint: tilt_joint}\n",
    "a misspelt joint of a controller": SERVOS.replace("[pan_joint, tilt_joint]", "[pan_jiont, tilt_joint]"),
    "a misspelt joint": SERVOS.replace("  tilt_joint: {", "  tlit_joint: {"),
    "a joint that no servo drives": SERVOS.replace("  tilt_joint: {actuator: tilt}\n", ""),
    "an unknown model": SERVOS.replace("AX-12", "AX-21"),
    "one id twice": SERVOS.replace("id: 2", "id: 1"),
    "a range the wrong way round": SERVOS.replace("[-50 deg, 30 deg]", "[30 deg, -50 deg]"),
    "a range of no length": SERVOS.replace("[-50 deg, 30 deg]", "[0 deg, 0 deg]"),
    "a range that only touches the body's": SERVOS.replace("[-50 deg, 30 deg]", "[1 rad, 120 deg]"),
    "a range outside of the body's": SERVOS.replace("[-50 deg, 30 deg]", "[90 deg, 120 deg]"),
    "a speed of nothing": SERVOS.replace("velocity: 60 deg/s", "velocity: 0 deg/s"),
    "an acceleration below 0": SERVOS.replace("velocity: 60 deg/s", "acceleration: -60 deg/s^2"),
    "a gear of nothing": SERVOS.replace("{actuator: tilt}", "{actuator: tilt, ratio: 0}"),
    "a joint twice in a controller": SERVOS.replace("[pan_joint, tilt_joint]", "[pan_joint, pan_joint]"),
    "a servo twice in a joint": SERVOS.replace("{actuator: tilt}", "{actuators: [tilt, tilt]}"),
    "a bus that does not exist": SERVOS.replace("{bus: servos, model: AX", "{bus: servoes, model: AX"),
    "faults of nothing": SERVOS
    + "faults:\n  one: {at: 1 s, fault: mute}\n  two: {at: 1 s, fault: mute, joint: pan_joint, bus: servos}\n",
    "a misspelt joint of a fault": SERVOS + "faults:\n  one: {at: 1 s, fault: mute, joint: pan_jiont}\n",
    "a fault of a joint that no servo drives": SERVOS.replace("  tilt_joint: {actuator: tilt}\n", "").replace(
        ", tilt_joint]", "]"
    )
    + "faults:\n  one: {at: 1 s, fault: mute, joint: tilt_joint}\n",
    "a fault of a bus without joints": SERVOS.replace("  servos: {", "  more: {type: dynamixel}\n  servos: {")
    + "faults:\n  one: {at: 1 s, fault: unplug, bus: more}\n",
    "a misspelt fault": SERVOS + "faults:\n  one: {at: 1 s, fault: overheet, joint: pan_joint}\n",
    "a joint that is unplugged": SERVOS + "faults:\n  one: {at: 1 s, fault: unplug, joint: pan_joint}\n",
    "an effort that is a force": SERVOS.replace("{actuator: tilt}", "{actuator: tilt, limits: {effort: 3 N}}"),
    "torque above all of it": SERVOS.replace("invert: true}", "invert: true, torque: 120 %}"),
    "two buses": SERVOS.replace("  servos: {", "  more: {type: dynamixel}\n  servos: {").replace(
        "{bus: servos, model: XL", "{bus: more, model: XL"
    ),
}


MIMIC = BODY.replace('<parent link="neck"/>', '<mimic joint="pan_joint"/><parent link="neck"/>')
FOLLOWING = SERVOS.replace(", tilt_joint]", "]")
WRONG_MIMICS = {
    "a controller of a joint that mimics another one": SERVOS,
    "a joint that mimics one that no servo drives": "\n".join(
        line for line in FOLLOWING.splitlines()[:-2] if "pan" not in line and "limits" not in line
    ),
    "a joint that mimics one of another bus": FOLLOWING.replace(
        "  servos: {", "  more: {type: dynamixel}\n  servos: {"
    ).replace("{bus: servos, model: XL", "{bus: more, model: XL"),
    "a joint that mimics another one with velocities": FOLLOWING.replace("invert: true", "mode: velocity"),
}


def check(folder: Path, text: str, body: str = BODY) -> Checked:
    return check_text(HEAD + text, folder, others={"head.urdf": body})


def driver_of(checked: Checked) -> Any:
    [found] = [instance.config for instance in checked.plan.instances if instance.type == "servo_bus"]
    return found


def test_a_bus_drives_its_joints_within_the_tighter_limits(tmp_path: Path) -> None:
    checked = check(tmp_path, SERVOS)
    assert checked.codes == []
    config = driver_of(checked)
    assert (config.rate, config.twin, list(config.controllers)) == (50.0, "servo", ["head"])
    pan, tilt = config.joints["pan_joint"], config.joints["tilt_joint"]
    assert (pan.lower, pan.upper, pan.velocity) == pytest.approx((-0.8727, 0.5236, 1.0472), abs=1e-4)
    assert (tilt.lower, tilt.upper, tilt.velocity, tilt.servos[0].invert) == (-1.0, 1.0, 2.0, True)


@pytest.mark.parametrize(
    ("actuator", "joint", "share"),
    [
        ("", "", 1.0 / 1.5),  # the effort of the URDF, of the 1.5 Nm that the servo has
        (", torque: 60 %", "", 0.6),
        ("", ", limits: {effort: 0.3 Nm}", 0.2),
        ("", ", ratio: 2, limits: {effort: 0.3 Nm}", 0.1),
        (", torque: 10 %", ", limits: {effort: 0.3 Nm}", 0.1),
        ("", ", limits: {effort: 1.5 Nm}", 1.0 / 1.5),  # that of the URDF is smaller
        ("", ", ratio: 3", 1.0 / 4.5),
    ],
)
def test_effort_becomes_a_share_of_the_torque_of_servos(
    tmp_path: Path, actuator: str, joint: str, share: float
) -> None:
    text = SERVOS.replace("invert: true", f"invert: true{actuator}")
    text = text.replace("{actuator: tilt}", f"{{actuator: tilt{joint}}}")
    checked = check(tmp_path, text)
    assert checked.codes == [], checked.text
    assert driver_of(checked).joints["tilt_joint"].servos[0].torque == pytest.approx(share)


def test_how_true_simulated_servos_are_is_told_at_the_bus(tmp_path: Path) -> None:
    text = SERVOS.replace("rate: 50 Hz}", "sim: ideal, twin: {noise: 0.5 deg, seed: 3}}")
    config = driver_of(check(tmp_path, text))
    assert (config.twin, config.seed) == ("ideal", 3)
    assert config.noise == pytest.approx(0.0087266, abs=1e-6)


FAULTS = """faults:
  hot: {at: 3 s, joint: pan_joint, fault: overheat, for: 10 s}
  pulled: {at: 5 s, bus: servos, fault: unplug}
"""


def test_faults_reach_the_driver_of_their_bus(tmp_path: Path) -> None:
    more = SERVOS.replace("  servos: {", "  more: {type: dynamixel}\n  servos: {").replace(
        "servos, model: XL", "more, model: XL"
    )
    checked = check(tmp_path, more.partition("controllers")[0] + FAULTS)
    assert checked.codes == []
    configs: dict[str, Any] = {
        instance.name: instance.config for instance in checked.plan.instances if instance.type == "servo_bus"
    }
    assert configs["more"].faults == {}
    faults = configs["servos"].faults
    assert {
        name: (twin_fault.at, twin_fault.joint, twin_fault.fault, twin_fault.lasts)
        for name, twin_fault in faults.items()
    } == {"hot": (3.0, "pan_joint", "overheat", 10.0), "pulled": (5.0, "", "unplug", None)}


def test_faults_do_nothing_to_real_servos_which_is_a_warning(tmp_path: Path) -> None:
    robot = HEAD + SERVOS.replace("rate: 50 Hz", "port: /dev/ttyUSB0") + FAULTS
    checked = check_text(robot, tmp_path, others={"head.urdf": BODY}, real=True)
    assert checked.codes == ["RBX2272"]
    assert driver_of(checked).faults == {}


def test_faults_of_a_part_are_of_its_joints(tmp_path: Path) -> None:
    part = PART + "faults:\n  hot: {at: 1 s, joint: pan_joint, fault: overheat}\n"
    robot = "rbx: 1\nkind: Robot\nname: one\nbuses: {servos: {type: dynamixel}}\ninclude:\n  left: part.yaml\n"
    checked = check_text(robot, tmp_path, others={"head.urdf": BODY, "part.yaml": part})
    assert checked.codes == []
    assert {name: fault.joint for name, fault in driver_of(checked).faults.items()} == {"left_hot": "left_pan_joint"}


def test_two_instances_of_a_part_bring_their_joints_to_one_bus(tmp_path: Path) -> None:
    robot = (
        "rbx: 1\nkind: Robot\nname: two\nbuses: {servos: {type: dynamixel}}\ninclude:\n  left: part.yaml\n"
        "  right: {part: part.yaml, with: {id: 2}, attach: {to: left_face}}\n"
    )
    checked = check_text(robot, tmp_path, others={"head.urdf": BODY, "part.yaml": PART})
    assert checked.codes == []
    config = driver_of(checked)
    assert {name: joint.servos[0].id for name, joint in config.joints.items()} == {
        "left_pan_joint": 1,
        "right_pan_joint": 2,
    }
    assert {name: controller.config.claimed for name, controller in config.controllers.items()} == {
        "left_look": ("left_pan_joint",),
        "right_look": ("right_pan_joint",),
    }


def test_each_mistake_is_told_at_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden) -> None:
    monkeypatch.chdir(tmp_path)
    told = {name: check(tmp_path, text).text for name, text in WRONG.items()}
    told |= {name: check(tmp_path, text, MIMIC).text for name, text in WRONG_MIMICS.items()}
    golden.check("servo_sections.txt", "\n".join(f"--- {name}\n{text}" for name, text in told.items()))


def test_real_servos_need_a_port(tmp_path: Path) -> None:
    checked = check_text(HEAD + SERVOS, tmp_path, others={"head.urdf": BODY}, real=True)
    assert checked.codes == ["RBX1002"]
    assert "robot.yaml:6:3" in checked.text


def first_help(text: str, tmp_path: Path) -> tuple[str, str]:
    """Return the code of the first finding about a robot with the head above, and what its help says."""
    checked = check_text(HEAD + text, tmp_path, others={"head.urdf": BODY})
    finding = next(iter(checked.compilation.report))
    return finding.code, finding.help


@pytest.mark.parametrize("word", ["baudrate", "baud_rate", "bitrate"])
def test_words_of_other_programs_for_the_rate_of_a_line_are_baud(word: str, tmp_path: Path) -> None:
    text = SERVOS.replace("rate: 50 Hz", f"{word}: 1000000")
    assert first_help(text, tmp_path) == ("RBX1001", "did you mean 'baud'?")


PUBLISHED = "what is measured is published without a controller: remove it"


@for_all(
    "written, cure",
    [
        ("joint_trajectory_controller/JointTrajectoryController", "did you mean 'joint_trajectory'?"),
        ("position_controllers/JointTrajectoryController", "did you mean 'joint_trajectory'?"),
        ("joint_trajectory_controller", "did you mean 'joint_trajectory'?"),
        ("forward_command_controller/ForwardCommandController", "did you mean 'joint_command'?"),
        ("position_controllers/JointGroupPositionController", "did you mean 'joint_command'?"),
        ("position_controllers/GripperActionController", "did you mean 'gripper'?"),
        ("parallel_gripper_action_controller/GripperActionController", "did you mean 'gripper'?"),
        ("diff_drive_controller/DiffDriveController", "did you mean 'diff_drive'?"),
        ("gpio_controllers/GpioCommandController", "did you mean 'gpio'?"),
        ("joint_state_broadcaster/JointStateBroadcaster", PUBLISHED),
        ("JointStateBroadcaster", PUBLISHED),
        ("joint_state_broadcaster", PUBLISHED),
        ("imu_sensor_broadcaster/IMUSensorBroadcaster", PUBLISHED),
        ("joint_state_controller/JointStateController", PUBLISHED),
        ("mecanum_drive_controller/MecanumDriveController", ""),
        ("admittance_controller/AdmittanceController", ""),
        ("joint_trajectry", "did you mean 'joint_trajectory'?"),
    ],
)
def test_types_of_ros2_control_have_ours_as_their_cure_or_none(written: str, cure: str, tmp_path: Path) -> None:
    assert first_help(SERVOS.replace("type: joint_trajectory", f"type: {written}"), tmp_path) == ("RBX1004", cure)
