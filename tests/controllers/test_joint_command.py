"""The controller of several joints by one message."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64, Float64MultiArray
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.soak import rare

TICK = 0.00512  # [rad] of an AX-12
LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 1.5, "acceleration": 8.0}
NAMES = ("pan", "tilt")


class Gaze:
    """Two joints that one message commands."""

    def __init__(self, **others: Any) -> None:
        joints = {
            name: {**LIMITS, "servos": [{"id": id_, "model": "AX-12"}]} for id_, name in enumerate(NAMES, start=1)
        }
        setup = {"type": "joint_command", "settings": {"type": "joint_command", "joints": ["tilt", "pan"], **others}}
        config = {"twin": "servo", "rate": 50.0, "joints": joints, "controllers": {"gaze": setup}}
        self.robot = Bench(instance("servos", "servo_bus", config))
        self.at: dict[str, float] = {}
        self.robot.bus.subscribe("me", "/joint_states", JointState, Qos.STATE, self._moved)
        self.robot.advance(0.2)
        driver: Any = self.robot.component("servos")
        self.controller = driver.controllers.controllers["gaze"]

    def _moved(self, message: JointState) -> None:
        self.at = dict(zip(message.name, map(float, message.position), strict=True))

    def command(self, *positions: float, time: float = 0.0) -> None:
        """Send positions of tilt and pan."""
        self.robot.publish("/gaze/commands", Float64MultiArray(data=np.array(positions)))
        self.robot.advance(time)


@settings(max_examples=settings().max_examples // 2)
@given(tilt=st.floats(-3.0, 3.0), pan=st.floats(-3.0, 3.0))
def test_joints_arrive_within_their_limits_and_are_free_then(tilt: float, pan: float) -> None:
    gaze = Gaze()
    gaze.command(tilt, pan, time=0.05)
    assert gaze.controller.leads or max(abs(tilt), abs(pan)) < 0.02
    gaze.robot.advance(3.0)
    wanted = {"tilt": max(-2.0, min(2.0, tilt)), "pan": max(-2.0, min(2.0, pan))}
    assert gaze.at == pytest.approx(wanted, abs=TICK)
    assert not gaze.controller.leads
    assert bool(gaze.controller.note) == (max(abs(tilt), abs(pan)) > 2.0)


@pytest.mark.parametrize("wrong", [(1.0,), (math.nan, 1.0), *rare((), (1.0, 1.0, 1.0), (1.0, math.inf))])
def test_a_command_that_makes_no_sense_is_refused_as_a_whole_with_a_note(wrong: tuple[float, ...]) -> None:
    gaze = Gaze()
    gaze.command(*wrong, time=1.0)
    assert gaze.at == pytest.approx({"pan": 0.0, "tilt": 0.0}, abs=TICK)
    assert not gaze.controller.leads
    assert "a command" in gaze.controller.note
    assert any("gaze: a command" in status.message for status in gaze.robot.statuses("servos") or _after(gaze))
    gaze.command(0.1, 0.1, time=1.0)
    assert not gaze.controller.note


def _after(gaze: Gaze) -> Any:
    told = gaze.robot.statuses("servos")
    gaze.robot.advance(1.5)
    return told


def test_single_commands_wait_until_the_joints_have_arrived() -> None:
    gaze = Gaze()
    gaze.command(1.0, 1.0, time=0.3)
    gaze.robot.publish("/pan/command", Float64(data=-1.0))
    gaze.robot.advance(3.0)
    assert gaze.at["pan"] == pytest.approx(1.0, abs=TICK)
    gaze.robot.publish("/pan/command", Float64(data=-1.0))
    gaze.robot.advance(3.0)
    assert gaze.at["pan"] == pytest.approx(-1.0, abs=TICK)


def test_without_new_commands_joints_come_to_rest_if_there_is_a_timeout() -> None:
    gaze = Gaze(timeout="0.3 s")
    gaze.command(1.5, 1.5, time=1.0)
    there = dict(gaze.at)
    assert 0.2 < there["pan"] < 1.0
    assert "no command for 0.3 s" in gaze.controller.note
    gaze.robot.advance(1.0)
    assert gaze.at == there
    for _ in range(20):
        gaze.command(1.5, 1.5, time=0.1)
    assert gaze.at["pan"] == pytest.approx(1.5, abs=TICK)


def test_a_joint_that_may_not_move_and_a_stop_bring_all_to_rest() -> None:
    gaze = Gaze()
    gaze.command(1.5, 1.5, time=0.5)
    gaze.robot.bus.client("me", "/tilt/enable", SetBool)(SetBool.Request(data=False), lambda reply: None)
    gaze.robot.advance(0.5)
    there = dict(gaze.at)
    assert "joint 'tilt': it is disabled" in gaze.controller.note
    gaze.robot.advance(1.0)
    assert gaze.at == there
    gaze.robot.bus.client("me", "/tilt/enable", SetBool)(SetBool.Request(data=True), lambda reply: None)
    gaze.command(0.0, 0.0, time=0.2)
    gaze.robot.host.stop()
    gaze.robot.advance(0.5)
    there = dict(gaze.at)
    gaze.command(1.0, 1.0, time=1.0)
    assert gaze.at == there


class Asked:
    """Goals that name some of the joints, and how they ended."""

    def __init__(self) -> None:
        self.gaze = Gaze()
        self.ended: list[Ended[MoveJoints.Result]] = []
        self.goals = self.gaze.robot.bus.action_client("me", "/gaze/move", MoveJoints)

    def move(self, time: float = 3.0, **positions: float) -> Any:
        goal = MoveJoints.Goal(joints=tuple(positions), positions=np.array(list(positions.values())))
        sent = self.goals(goal, self.ended.append)
        self.gaze.robot.advance(time)
        return sent

    @property
    def outcomes(self) -> list[Outcome]:
        return [one.outcome for one in self.ended]


def test_a_goal_names_some_joints_and_ends_when_they_have_arrived() -> None:
    asked = Asked()
    asked.move(pan=0.5)
    assert asked.outcomes == [Outcome.SUCCEEDED]
    assert asked.gaze.at == pytest.approx({"pan": 0.5, "tilt": 0.0}, abs=TICK)


def test_a_goal_that_is_replaced_canceled_or_cannot_go_on_says_so() -> None:
    asked = Asked()
    asked.move(0.2, pan=1.0)
    asked.gaze.command(0.0, 0.0, time=0.2)
    assert asked.ended[-1].result == MoveJoints.Result(message="replaced by a command")
    asked.move(0.2, tilt=1.0).cancel()
    asked.gaze.robot.advance(0.5)
    assert asked.outcomes[-1] is Outcome.CANCELED
    asked.move(0.2, tilt=1.5)
    client = asked.gaze.robot.bus.client("me", "/tilt/enable", SetBool)
    client(SetBool.Request(data=False), lambda reply: None)
    asked.gaze.robot.advance(0.5)
    assert asked.ended[-1].result == MoveJoints.Result(message="joint 'tilt': it is disabled")


@pytest.mark.parametrize("goal", [{}, {"roll": 1.0}, {"pan": math.nan}])
def test_a_goal_that_makes_no_sense_is_refused(goal: dict[str, float]) -> None:
    asked = Asked()
    asked.move(0.5, **goal)
    assert asked.outcomes == [Outcome.REJECTED]
