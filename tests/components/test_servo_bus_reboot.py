"""Starting the servos of a joint again, by its service and in missions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.domains.servos.components.servo_bus import ServoBusDriver
from rbxcompose.domains.servos.joint_states import JointMode
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, check_text, instance, run_robot

LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 1.5, "acceleration": 8.0}


class Arm:
    """Two joints of one model on a twin; the servo of `pan` has shut down."""

    def __init__(self, model: str = "XL430-W250", twin: str = "servo") -> None:
        joints = {
            name: {**LIMITS, "servos": [{"id": id_, "model": model}]} for id_, name in enumerate(("pan", "tilt"), 1)
        }
        faults = {
            "heavy": {"at": 0.5, "fault": "overload", "joint": "pan", "lasts": 0.5},
            "silent": {"at": 5.0, "fault": "mute", "joint": "pan", "lasts": 2.5},
            "gone": {"at": 9.0, "fault": "unplug", "lasts": 0.5},
        }
        self.robot = Bench(
            instance("servos", "servo_bus", {"twin": twin, "joints": joints, "faults": faults}), start=False
        )
        driver = self.robot.component("servos")
        assert isinstance(driver, ServoBusDriver)
        self.driver = driver
        self.replies: list[Reply[Trigger.Response]] = []
        self.until(0.2)
        self.go(1.0)
        self.until(1.5)

    def until(self, time: float) -> None:
        self.robot.advance(time - self.robot.clock.now())

    @property
    def pan(self) -> Any:
        return self.driver.cycle.drives["pan"]

    @property
    def mode(self) -> str:
        return str(self.pan.mode)

    def go(self, position: float) -> None:
        self.robot.bus.publisher("me", "/pan/command", Float64, Qos.COMMAND)(Float64(data=position))
        self.robot.advance(0.02)

    def reboot(self, wait: float = 0.4) -> None:
        self.robot.bus.client("me", "/pan/reboot", Trigger)(Trigger.Request(), self.replies.append)
        self.robot.advance(wait)

    @property
    def answer(self) -> tuple[bool, str]:
        assert self.replies[-1].response
        return self.replies[-1].response.success, self.replies[-1].response.message


@pytest.mark.parametrize("twin", ["servo", "ideal"])
def test_a_servo_that_has_shut_down_takes_torque_again_after_a_reboot(twin: str) -> None:
    arm = Arm(twin=twin)
    assert arm.mode == JointMode.FAULT
    arm.robot.bus.client("me", "/pan/enable", SetBool)(SetBool.Request(data=True), lambda reply: None)
    arm.robot.advance(0.1)
    assert arm.mode == JointMode.FAULT
    arm.reboot()
    assert arm.answer == (True, "")
    assert arm.mode == JointMode.RELAXED
    arm.go(0.3)
    arm.robot.advance(1.5)
    assert arm.pan.measured.position == pytest.approx(0.3, abs=0.005)


def test_commands_are_refused_while_a_servo_starts_again_and_its_watchdog_is_armed_anew() -> None:
    arm = Arm()
    arm.reboot(0.05)
    assert arm.replies == []
    arm.go(0.5)
    assert arm.pan.refused == "its servos start again"
    arm.reboot(0.01)
    assert arm.answer == (False, "its servos start again")
    arm.robot.advance(0.3)
    assert arm.answer == (True, "")
    assert arm.driver.cycle.bus.read([1], ["bus_watchdog", "torque_enable"])[1].values == {
        "bus_watchdog": 10,
        "torque_enable": 0,
    }


def test_a_joint_that_a_person_has_disabled_stays_so() -> None:
    arm = Arm()
    arm.robot.bus.client("me", "/pan/enable", SetBool)(SetBool.Request(data=False), lambda reply: None)
    arm.reboot()
    assert arm.answer == (True, "")
    assert arm.mode == JointMode.DISABLED


def test_a_servo_that_does_not_come_back_is_told() -> None:
    arm = Arm()
    arm.until(5.1)
    arm.reboot(0.1)
    assert arm.answer == (False, "servo 1 did not confirm the reboot")


def test_a_servo_that_falls_silent_or_loses_its_bus_ends_the_reboot_with_the_reason() -> None:
    arm = Arm()
    arm.until(4.95)
    arm.reboot(2.5)
    assert arm.answer == (False, "servo 1 did not answer for 2 s after the reboot")
    arm.until(8.96)
    arm.reboot(0.2)
    assert arm.answer == (False, "the bus of servos has gone")
    arm.reboot(0.01)
    assert arm.replies[-1].error == "the bus of servos has gone"


def test_protocol_1_has_no_reboot_and_the_answer_tells_what_to_do() -> None:
    arm = Arm("AX-12")
    arm.reboot(0.02)
    success, message = arm.answer
    assert not success
    assert message == (
        "servo 1 (AX-12) speaks protocol 1.0, which has no reboot: enable the joint when its error is gone, "
        "or switch its supply off and on"
    )


BODY = """<robot name="head"><link name="base"/><link name="neck"/>
<joint name="pan_joint" type="revolute"><parent link="base"/><child link="neck"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="2"/></joint></robot>
"""
ROBOT = """rbx: 1
kind: Robot
name: head
body: {urdf: head.urdf}
buses:
  servos: {type: dynamixel}
actuators:
  pan: {bus: servos, model: XL430-W250, id: 1}
joints:
  pan_joint: {actuator: pan}
faults:
  heavy: {at: 0.1 s, joint: pan_joint, fault: overload, for: 0.5 s}
missions:
  recover: recover.yaml
start: recover
"""
MISSION = """rbx: 1
kind: Mission
name: recover
do:
  - wait: 1 s
  - reboot_pan_joint
"""


def test_a_mission_reboots_a_joint_by_a_skill_of_its_name(tmp_path: Path) -> None:
    checked = check_text(ROBOT, tmp_path, others={"head.urdf": BODY, "recover.yaml": MISSION})
    assert checked.codes == [], checked.text
    assert run_robot(checked.plan, most=10.0).outcome == "success"
