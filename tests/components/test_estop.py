"""The emergency stop: whom it stops, when, and who can release it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.compiler.plan.model import Instance
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.std_msgs import Bool, Float64
from rbxcompose.sdk.component import RobotHeld
from rbxcompose.testing import Bench, check_text, instance

PRESSED = "'estop' is pressed"
MISSING = "nothing came on 'estop' for 0.5 s"
LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 1.0, "acceleration": 8.0}


class Cell:
    """An emergency stop beside a base and a joint, and a button that tells 20 times a second whether it is pressed."""

    def __init__(self, *relaxes: str) -> None:
        joints = {"pan": {**LIMITS, "servos": [{"id": 1, "model": "AX-12"}]}}
        self.robot = Bench(
            instance("base", "diff_drive_sim", {"max_speed": "0.5 m/s", "max_turn_rate": "90 deg/s"}),
            instance("servos", "servo_bus", {"twin": "servo", "joints": joints}),
            instance("estop", "estop", {"relaxes": list(relaxes)}),
        )
        self.base: Any = self.robot.component("base")
        self.drive: Any = self.robot.component("servos").cycle.drives["pan"]  # type: ignore[attr-defined]

    def wait(self, seconds: float, *, pressed: bool | None = False) -> None:
        """Let time pass; the button tells nothing if it is None."""
        for _ in range(round(seconds / 0.05)):
            if pressed is not None:
                self.robot.publish("/estop", Bool(data=pressed))
            self.robot.publish("/cmd_vel", Twist(linear=Vector3(x=0.3)))
            self.robot.publish("/pan/command", Float64(data=1.5))
            self.robot.advance(0.05)

    @property
    def told(self) -> list[str]:
        """What the supervisor was told."""
        return [event.reason for event in self.robot.events if isinstance(event, RobotHeld)]

    def moves(self) -> bool:
        return not self.base.is_at_rest or abs(self.drive.measured.velocity) > 0.01


def test_a_pressed_button_stops_the_base_and_the_joints_until_the_release() -> None:
    cell = Cell()
    cell.wait(1.0)
    assert cell.moves()
    cell.wait(0.8, pressed=True)
    assert not cell.moves()
    assert str(cell.drive.mode) == "holding"
    cell.wait(1.0)
    assert not cell.moves()  # it latches
    assert cell.told == ["", PRESSED, ""]
    cell.robot.host.release()
    cell.wait(0.5)
    assert cell.moves()
    assert [text for text in cell.robot.texts() if "emergency stop" in text] == [
        f"estop: emergency stop: {PRESSED}; everything that moves is held until 'release'"
    ]


def test_a_release_while_it_is_pressed_stops_again_at_once() -> None:
    cell = Cell()
    cell.wait(0.5)
    cell.wait(1.0, pressed=True)
    cell.robot.host.release()
    cell.wait(0.5, pressed=True)
    assert not cell.moves()
    assert cell.told == ["", PRESSED, PRESSED]


def test_messages_that_stay_away_stop_it_also_those_that_never_came() -> None:
    cell = Cell()
    cell.wait(0.45, pressed=None)
    assert cell.told == []
    cell.wait(0.1, pressed=None)
    assert cell.told == [MISSING]
    cell.wait(0.1)
    assert cell.told == [MISSING, ""]
    cell.robot.host.release()
    cell.wait(1.0)
    assert cell.moves()
    cell.wait(1.3, pressed=None)
    assert not cell.moves()
    assert cell.told == [MISSING, "", MISSING]


def test_joints_lose_their_torque_where_that_is_wanted() -> None:
    cell = Cell("servos")
    cell.wait(1.0)
    assert str(cell.drive.mode) == "active"
    cell.wait(0.1, pressed=True)
    assert str(cell.drive.mode) == "relaxed"
    cell.wait(1.0)
    assert str(cell.drive.mode) == "relaxed"
    assert cell.drive.refused == "the robot is stopped"


@given(st.lists(st.sampled_from([True, False, None]), max_size=12))
def test_the_supervisor_always_knows_the_reason(story: list[bool | None]) -> None:
    robot = Bench(instance("estop", "estop"))
    silent, is_down = 0.0, False
    for pressed in story:
        if pressed is not None:
            robot.publish("/estop", Bool(data=pressed))
            silent, is_down = 0.0, pressed
        robot.advance(0.3)
        silent += 0.3
        reason = PRESSED if is_down else MISSING if silent >= 0.5 else ""
        held = [event.reason for event in robot.events if isinstance(event, RobotHeld)]
        assert (held or [""])[-1] == reason
        assert robot.host.is_stopped >= bool(reason)


ROBOT = """rbx: 1
kind: Robot
name: carrier
body: {urdf: rbx:robots/rover/rover.urdf}
buses:
  servos: {type: dynamixel}
actuators:
  left: {bus: servos, model: XL430-W250, id: 1, mode: velocity}
joints:
  left_wheel_joint: {actuator: left}
safety:
  estop: {topic: button, deadline: 0.2 s, what: WHAT}
"""


@pytest.mark.parametrize(("what", "relaxed"), [("hold", []), ("relax", ["servos"])])
def test_a_manifest_asks_for_it_under_safety(what: str, relaxed: list[str], tmp_path: Path) -> None:
    checked = check_text(ROBOT.replace("WHAT", what), tmp_path)
    assert checked.codes == [], checked.text
    found: list[Instance] = [one for one in checked.plan.instances if one.type == "estop"]
    config: Any = found[0].config
    assert (config.topic, config.deadline, config.relaxes) == ("button", 0.2, relaxed)
