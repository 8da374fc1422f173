"""The controller of grippers: opening, closing on an object, refusals, and what its settings may be."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.bus_config import ControllerSetup
from rbxcompose.domains.servos.controllers.gripper import NEEDED, OPTIONAL, GripperConfig, GripperController, model_of
from rbxcompose.manifest.shapes import as_written
from rbxcompose.msgs.control_msgs import GripperCommand, GripperCommandMessage
from rbxcompose.msgs.rbxcompose_msgs import Grip
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk.bound import Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_text
from tests.soak import rare

HAND: dict[str, Any] = {
    "type": "gripper",
    "model": "one_sided",
    "joint": "finger",
    "pad_width": "5 cm",
    "finger_length": "10 cm",
    "opening": ["1 cm", "10 cm"],
}
TWO = {
    "type": "gripper",
    "model": "dual",
    "left": "finger",
    "right": "thumb",
    "pad_width": "2 cm",
    "finger_length": "8 cm",
    "opening": ["0 cm", "9 cm"],
}
LIMITS = {"lower": -1.0, "upper": 1.0, "velocity": 1.5, "acceleration": 8.0}
MODELS: dict[str, dict[str, Any]] = {
    "one_sided": {"joint": "a", "pad_width": "1 cm", "finger_length": "5 cm", "opening": ["0 cm", "9 cm"]},
    "dual": {"left": "a", "right": "b", "pad_width": "1 cm", "finger_length": "5 cm", "opening": ["0 cm", "9 cm"]},
    "parallel": {"joint": "a", "travel": "12 cm", "opening": ["0 cm", "4 cm"]},
    "sliding": {"joint": "a", "opening": ["0 cm", "4 cm"]},
    "calibrated": {
        "joint": "a",
        "calibration": [{"opening": "4 cm", "angle": "50 deg"}, {"opening": "0 mm", "angle": "10 deg"}],
    },
}
OTHERS = {
    "center": "5 deg",
    "center_left": "5 deg",
    "center_right": "-5 deg",
    "invert": True,
    "invert_left": True,
    "invert_right": True,
}
TELLS = ("joint", "left", "right", "pad_width", "finger_length", "opening", "travel", "calibration")


class Hand:
    """A gripper, how far it is open, and how the last goal ended."""

    def __init__(self, settings: dict[str, Any] = HAND, **others: Any) -> None:
        joints = {
            name: {**LIMITS, "servos": [{"id": id_, "model": "AX-12"}]}
            for id_, name in enumerate(("finger", "thumb"), start=1)
        }
        setup = {"hand": {"type": "gripper", "settings": settings | others}}
        self.robot = Bench(instance("servos", "servo_bus", {"twin": "servo", "joints": joints, "controllers": setup}))
        self.model = model_of(GripperConfig.model_validate(settings | others))
        self.led = ("finger", "thumb") if settings["model"] == "dual" else ("finger",)
        self.at: dict[str, float] = {}
        self.seen: list[Any] = []  # feedback
        bus = self.robot.bus
        bus.subscribe("me", "/joint_states", JointState, Qos.STATE, self._moved)
        self.commands = bus.action_client("me", "/hand/gripper_cmd", GripperCommand)
        self.grips = bus.action_client("me", "/hand/grip", Grip)
        self.robot.advance(0.2)

    def _moved(self, message: JointState) -> None:
        self.at = dict(zip(message.name, map(float, message.position), strict=True))

    @property
    def opening(self) -> float:
        return self.model.opening([self.at[name] for name in self.led])

    @property
    def servo(self) -> Any:
        driver: Any = self.robot.component("servos")
        return driver.cycle.bus.line[1]

    def grip(self, opening: float, time: float = 0.0) -> list[Any]:
        """Send a goal; return the list in which its end will be."""
        ends: list[Any] = []
        self.sent = self.grips(Grip.Goal(opening=opening), ends.append, self.seen.append)
        self.robot.advance(time)
        return ends

    def command(self, opening: float, time: float = 0.0) -> list[Any]:
        """Send a goal as others do."""
        ends: list[Any] = []
        goal = GripperCommand.Goal(command=GripperCommandMessage(position=opening, max_effort=10.0))
        self.commands(goal, ends.append, self.seen.append)
        self.robot.advance(time)
        return ends

    def ask(self, topic: str, service: Any, request: Any) -> None:
        self.robot.bus.client("me", topic, service)(request, lambda reply: None)
        self.robot.advance(0.1)


@pytest.mark.parametrize("settings", [HAND, TWO], ids=["one_sided", "dual"])
@pytest.mark.parametrize("opening", [0.03, *rare(0.01, 0.09)])
def test_it_opens_as_far_as_it_is_told(settings: dict[str, Any], opening: float) -> None:
    hand = Hand(settings)
    [ended] = hand.grip(opening, 3.0)
    assert ended.outcome is Outcome.SUCCEEDED
    assert ended.result.reached
    assert not ended.result.stalled
    assert ended.result.opening == pytest.approx(opening, abs=0.002)
    assert hand.opening == pytest.approx(opening, abs=0.001)


def test_both_actions_lead_the_same_gripper_and_the_newest_goal_replaces_the_other() -> None:
    hand = Hand()
    first = hand.grip(0.09, 0.2)
    second = hand.command(0.02, 0.1)
    assert first[0].outcome is Outcome.ABORTED
    assert first[0].result.message == "replaced by a newer goal of 'command'"
    third = hand.grip(0.03, 0.1)
    assert second[0].outcome is Outcome.ABORTED
    assert hand.grip(math.nan, 0.1)[0].outcome is Outcome.REJECTED
    assert not third
    fourth = hand.grip(0.08, 3.0)
    assert third[0].result.message == "replaced by a newer goal of 'grip'"
    assert fourth[0].outcome is Outcome.SUCCEEDED
    assert hand.opening == pytest.approx(0.08, abs=0.001)


def test_a_jammed_gripper_holds_an_object_and_presses_a_little_only() -> None:
    hand = Hand()
    hand.grip(0.09, 3.0)
    ends = hand.grip(0.01)
    hand.robot.advance(0.3)
    hand.servo.faults.is_jammed = True
    hand.robot.advance(3.0)
    [ended] = ends
    assert ended.outcome is Outcome.SUCCEEDED
    assert (ended.result.stalled, ended.result.reached, ended.result.outcome) == (True, False, "stalled")
    pressed = hand.model.opening([hand.servo.model.per_tick * (hand.servo.get("goal_position") - 512)])
    assert ended.result.opening - pressed == pytest.approx(0.005, abs=0.001)


def test_a_stall_may_be_a_failure_and_the_gripper_stays_where_it_is() -> None:
    hand = Hand(on_stall="fail", stall={"progress": "2 mm", "window": "0.4 s"})
    hand.servo.faults.is_jammed = True
    [ended] = hand.command(0.01, 1.0)
    assert ended.outcome is Outcome.ABORTED
    assert (ended.result.stalled, ended.result.reached_goal) == (True, False)
    assert abs(hand.servo.get("goal_position") - hand.servo.get("present_position")) <= 1


@pytest.mark.parametrize("opening", [math.nan, math.inf, -0.01, 0.2])
def test_what_cannot_be_is_refused_with_the_reason(opening: float) -> None:
    hand = Hand()
    for ends in (hand.grip(opening, 0.3), hand.command(opening, 0.3)):
        assert ends[0].outcome is Outcome.REJECTED
    driver: Any = hand.robot.component("servos")
    assert not driver.controllers.leader("finger")
    assert sum("it opens from 0.01 m to 0.1 m" in text for text in hand.robot.texts()) == 2, hand.robot.texts()


def test_a_canceled_grip_stays_as_far_open_as_it_is() -> None:
    hand = Hand(speed="2 cm/s")
    ends = hand.grip(0.1, 1.0)
    hand.sent.cancel()
    hand.robot.advance(0.3)
    there = hand.opening
    assert ends[0].outcome is Outcome.CANCELED
    assert 0.055 < there < 0.09
    hand.robot.advance(1.0)
    assert hand.opening == there


def test_it_opens_no_faster_than_permitted_and_tells_how_far_it_is() -> None:
    hand = Hand(speed="2 cm/s")
    ends = hand.grip(0.01, 4.0)
    assert ends
    hand.seen.clear()
    ends = hand.grip(0.09, 2.0)
    assert not ends
    assert hand.opening == pytest.approx(0.05, abs=0.004)
    openings = [one.opening for one in hand.seen]
    assert len(openings) > 20
    assert openings == sorted(openings)
    hand.robot.advance(2.5)
    assert ends[0].outcome is Outcome.SUCCEEDED


def test_a_joint_that_may_not_move_ends_the_grip_with_the_reason() -> None:
    hand = Hand()
    ends = hand.grip(0.09, 0.1)
    hand.ask("/finger/enable", SetBool, SetBool.Request(data=False))
    assert ends[0].outcome is Outcome.ABORTED
    assert "joint 'finger': it is disabled" in ends[0].result.message
    [ended] = hand.grip(0.03, 0.3)
    assert "disabled" in ended.result.message


def test_a_relaxed_joint_ends_the_grip_and_a_stop_does() -> None:
    hand = Hand()
    ends = hand.grip(0.09, 0.1)
    hand.ask("/finger/relax", Trigger, Trigger.Request())
    assert "relaxed" in ends[0].result.message
    assert hand.servo.get("torque_enable") == 0
    ends = hand.grip(0.02, 0.2)
    hand.robot.host.stop()
    hand.robot.advance(0.5)
    there = hand.opening
    assert ends[0].outcome is not Outcome.SUCCEEDED
    assert hand.grip(0.02, 1.0)[0].outcome is Outcome.REJECTED
    assert hand.opening == there


# Settings


def config_of(model: str, **others: Any) -> GripperConfig:
    return GripperConfig.model_validate({"type": "gripper", "model": model, **MODELS[model], **others})


@pytest.mark.parametrize("model", MODELS)
def test_each_model_takes_its_own_keys_and_no_others(model: str) -> None:
    own = {key: OTHERS[key] for key in OPTIONAL[model]}
    assert GripperController.mistake(config_of(model, **own)) is None
    for other in MODELS:
        for key, value in (MODELS[other] | OTHERS).items():
            if key not in NEEDED[model] + OPTIONAL[model]:
                mistake = GripperController.mistake(config_of(model, **{key: value}))
                assert mistake
                assert mistake[0] == key
    for key in NEEDED[model]:
        mistake = GripperController.mistake(config_of(model, **{key: None}))
        assert mistake
        assert mistake[0] == "model"
        assert f"'{key}'" in mistake[1]


def test_a_servo_that_turns_back_while_it_opens_is_told_with_its_openings() -> None:
    angles = {"1 cm": "-20 deg", "2 cm": "10 deg", "3 cm": "0 deg", "4 cm": "20 deg"}
    pairs = [{"opening": opening, "angle": angle} for opening, angle in angles.items()]
    where, words = GripperController.mistake(config_of("calibrated", calibration=pairs)) or ("", "")
    assert where == "calibration"
    assert words == "as it opens, the servo turns one way only, but 0 deg at 0.03 m follows 10 deg at 0.02 m"


@given(
    pad=st.floats(0.0, 0.1),
    finger=st.floats(0.005, 0.2),
    least=st.floats(0.0, 0.3),
    more=st.floats(0.003, 0.3),
    center=st.floats(-1, 1),
    invert=st.booleans(),
)
def test_what_is_no_mistake_has_an_angle_for_each_opening_and_the_ends_bound_them(
    pad: float, finger: float, least: float, more: float, center: float, invert: bool
) -> None:
    config = config_of(
        "one_sided",
        pad_width=f"{pad!r} m",
        finger_length=f"{finger!r} m",
        opening=[f"{least!r} m", f"{least + more!r} m"],
        center=f"{center!r} rad",
        invert=invert,
    )
    reachable = pad - 2 * finger <= least and least + more <= pad + 2 * finger
    mistake = GripperController.mistake(config)
    assert (mistake is None) == reachable
    if mistake is None:
        [(low, high)] = GripperController.asks(config).values()
        model = model_of(config)
        for opening in (least, least + more / 3, least + more):
            [angle] = model.angles(opening)
            assert low - 1e-9 <= angle <= high + 1e-9
            assert model.opening([angle]) == pytest.approx(opening, abs=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_settings_reach_the_bus_as_they_were_written(model: str) -> None:
    config = config_of(model, **{key: OTHERS[key] for key in OPTIONAL[model]})
    assert ControllerSetup(type="gripper", settings=as_written(config)).config == config


def test_travel_is_the_opening_of_one_turn() -> None:
    model = model_of(config_of("parallel", travel="10 cm", opening=["0 cm", "10 cm"], center="1 rad"))
    assert model.angles(0.1) == pytest.approx((1.0 + math.tau,))
    inverted = model_of(config_of("parallel", travel="10 cm", opening=["0 cm", "10 cm"], invert=True))
    assert inverted.angles(0.05) == pytest.approx((-math.pi,))


def test_fingers_that_slide_go_half_of_the_opening_each() -> None:
    config = config_of("sliding", opening=["1 cm", "10 cm"])
    assert model_of(config).angles(0.06) == (0.03,)
    assert GripperController.asks(config) == {"a": (0.005, 0.05)}


# A robot in YAML

BODY = """<robot name="hand">
  <link name="palm"/>
  <link name="finger"/>
  <joint name="finger_joint" type="revolute">
    <parent link="palm"/><child link="finger"/><axis xyz="0 0 1"/>
    <limit lower="-0.8" upper="0.5" effort="1" velocity="2"/>
  </joint>
</robot>
"""
ROBOT = """rbx: 1
kind: Robot
name: hand
body: {urdf: hand.urdf}
buses:
  servos: {type: dynamixel}
actuators:
  finger: {bus: servos, model: AX-12, id: 9}
joints:
  finger_joint: {actuator: finger}
controllers:
  hand:
    type: gripper
    model: one_sided
    joint: finger_joint
    pad_width: 7 cm
    finger_length: 10 cm
    opening: [0 cm, 16 cm]
"""
WRONG = {
    "fingers that slide with a joint that turns": ROBOT.replace("one_sided", "sliding")
    .replace("    pad_width: 7 cm\n", "")
    .replace("    finger_length: 10 cm\n", ""),
    "a key of another model": ROBOT + "    travel: 8 mm\n",
    "an opening that is not reachable": ROBOT.replace("16 cm", "30 cm"),
    "an opening beyond the limits of the joint": ROBOT.replace("16 cm", "20 cm"),
    "tighter limits of the joint": ROBOT.replace("finger}\n", "finger, limits: {position: [-20 deg, 20 deg]}}\n"),
    "a joint that is missing": ROBOT.replace("    joint: finger_joint\n", ""),
    "a misspelt joint": ROBOT.replace("joint: finger_joint", "joint: fingre_joint"),
    "a misspelt model": ROBOT.replace("one_sided", "onesided"),
    "a range that is none": ROBOT.replace("[0 cm, 16 cm]", "[16 cm, 0 cm]"),
    "a tolerance of everything": ROBOT + "    tolerance: 20 cm\n",
    "a speed that seems to be a stall": ROBOT + "    speed: 0.05 cm/s\n",
}
MISSION = "rbx: 1\nkind: Mission\nname: pinch\ndo:\n  - hand: {}\n"


def check(folder: Path, text: str, mission: str = "") -> Checked:
    others = {"hand.urdf": BODY}
    if mission:
        text += "missions:\n  pinch: pinch.yaml\n"
        others["pinch.yaml"] = MISSION.replace("{}", mission)
    return check_text(text, folder, others=others)


def test_each_mistake_is_told_at_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden) -> None:
    monkeypatch.chdir(tmp_path)
    assert check(tmp_path, ROBOT).codes == []
    told = {name: check(tmp_path, text).text for name, text in WRONG.items()}
    golden.check("gripper.txt", "\n".join(f"--- {name}\n{text}" for name, text in told.items()))


def test_missions_open_it_by_a_length(tmp_path: Path) -> None:
    assert check(tmp_path, ROBOT, "2 cm").codes == []
    for wrong in ("2 deg", "2 s"):
        assert check(tmp_path, ROBOT, wrong).codes == ["RBX4105"], wrong
