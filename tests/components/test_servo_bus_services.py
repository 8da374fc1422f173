"""The services of joints: speeds, relaxing, enabling; one by one and all at once."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.msgs.rbxcompose_msgs import SetSpeed
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk.bound import Outcome, Reply
from tests.components.test_servo_bus import CONFIG, TICK, Head


@pytest.fixture(params=["servo", "ideal"])
def head(request: pytest.FixtureRequest) -> Head:
    return Head(twin=request.param)


@pytest.mark.parametrize("model", ["AX-12", "MX-28", "XL430-W250"])
def test_a_speed_is_one_in_radians_whatever_the_ticks_of_the_model(model: str) -> None:
    limits = {"lower": -2.0, "upper": 2.0, "velocity": 3.0, "acceleration": 100.0}
    one = Head(joints=CONFIG["joints"] | {"pan": {**limits, "servos": [{"id": 1, "model": model}]}})
    one.ask("/pan/set_speed", SetSpeed, SetSpeed.Request(speed=0.5))
    one.commands["pan"](Float64(data=1.5))
    one.robot.advance(0.5)
    begin = one.at["pan"]
    one.robot.advance(2.0)
    assert one.at["pan"] - begin == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_a_speed_that_is_none_is_refused(head: Head, speed: float) -> None:
    told: list[Reply[SetSpeed.Response]] = []
    head.robot.bus.client("me", "/pan/set_speed", SetSpeed)(SetSpeed.Request(speed=speed), told.append)
    head.robot.advance(0.1)
    assert told[0].response is not None
    assert not told[0].response.success


def test_a_joint_that_is_relaxed_ends_the_trajectory_of_its_group(head: Head) -> None:
    head.follow((1.0, 1.0, 3.0))
    head.robot.advance(1.0)
    head.ask("/pan/relax", Trigger, Trigger.Request())
    head.robot.advance(1.0)
    assert head.ended
    assert head.ended.outcome is Outcome.ABORTED
    assert head.ended.result
    assert "'pan' was relaxed" in head.ended.result.error_string
    driver: Any = head.robot.component("servos")
    assert str(driver.cycle.drives["pan"].mode) == "relaxed"


def test_all_joints_are_relaxed_and_disabled_at_once(head: Head) -> None:
    driver: Any = head.robot.component("servos")
    for name in ("pan", "tilt"):
        head.commands[name](Float64(data=0.3))
    head.robot.advance(1.0)
    head.ask("/servos/relax_all", Trigger, Trigger.Request())
    assert {str(drive.mode) for drive in driver.cycle.drives.values()} == {"relaxed"}
    head.ask("/servos/enable_all", SetBool, SetBool.Request(data=False))
    head.commands["pan"](Float64(data=0.0))
    head.robot.advance(1.0)
    assert {str(drive.mode) for drive in driver.cycle.drives.values()} == {"disabled"}
    assert head.at["pan"] == pytest.approx(0.3, abs=TICK)


def test_a_joint_that_holds_goes_on_holding_although_its_servo_tells_late_that_it_does() -> None:
    mute = {"late": {"at": 0.0, "fault": "mute", "joint": "pan", "lasts": 0.4}}
    head = Head(on_shutdown="hold", faults=mute)
    driver: Any = head.robot.component("servos")
    servo = driver.cycle.bus.line[1]
    driver.start_by("pan", "wait")  # it did not tell at the start
    servo.set("torque_enable", 1)  # by an earlier driver
    head.robot.advance(0.6)
    assert [str(drive.mode) for drive in driver.cycle.drives.values()] == ["holding", "relaxed"]
    assert servo.get("torque_enable") == 1


def test_a_command_beyond_the_limits_is_clamped_and_said(head: Head) -> None:
    told = head.robot.statuses("servos")
    head.commands["pan"](Float64(data=9.0))
    head.robot.advance(2.5)
    assert "pan: a command for 9 is clamped to its limit, 2" in told[-1].message
    head.commands["pan"](Float64(data=0.0))
    head.robot.advance(2.5)
    assert "clamped" not in told[-1].message


def test_a_joint_whose_replies_are_lost_on_its_way_is_parked_all_the_same() -> None:
    mute = {"silent": {"at": 2.4, "fault": "mute", "joint": "pan", "lasts": 0.3}}
    head = Head(twin="servo", on_shutdown="park", park={"pan": -1.0}, park_time=20.0, faults=mute)
    head.commands["pan"](Float64(data=1.0))
    head.robot.advance(2.0)
    head.robot.component("servos").brake()
    head.robot.advance(1.0)
    driver: Any = head.robot.component("servos")
    assert not driver.is_at_rest
    head.robot.advance(8.0)
    assert driver.is_at_rest
    assert head.at["pan"] == pytest.approx(-1.0, abs=0.02)
