"""Trajectories on a topic, which are no goals: each replaces what leads the joints, and the last one is followed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_duration
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 1.5, "acceleration": 8.0}


class Head:
    """One joint that is led along trajectories."""

    def __init__(self) -> None:
        joints = {"pan": {**LIMITS, "servos": [{"id": 1, "model": "AX-12"}]}}
        setup = {"type": "joint_trajectory", "settings": {"type": "joint_trajectory", "joints": ["pan"]}}
        config = {"twin": "servo", "joints": joints, "controllers": {"head": setup}}
        self.robot = Bench(instance("servos", "servo_bus", config))
        self.at = 0.0
        self.robot.bus.subscribe("me", "/joint_states", JointState, Qos.STATE, self._moved)
        self.robot.advance(0.2)
        driver: Any = self.robot.component("servos")
        self.controller = driver.controllers.controllers["head"]

    def _moved(self, message: JointState) -> None:
        self.at = float(message.position[0])

    def send(self, *points: tuple[float, float], time: float) -> None:
        """Send positions, each with its time."""
        made = (
            JointTrajectoryPoint(positions=np.array([at]), time_from_start=to_duration(when)) for at, when in points
        )
        self.robot.publish("/head/joint_trajectory", JointTrajectory(joint_names=("pan",), points=tuple(made)))
        self.robot.advance(time)


def test_the_last_trajectory_is_followed_and_an_empty_one_stops() -> None:
    head = Head()
    head.send((1.0, 2.0), time=1.0)
    head.send((-0.5, 1.5), time=3.0)
    assert head.at == pytest.approx(-0.5, abs=0.01)
    head.send((1.0, 3.0), time=1.0)
    head.send(time=1.0)
    stopped = head.at
    assert -0.4 < stopped < 0.9
    head.robot.advance(2.0)
    assert head.at == pytest.approx(stopped, abs=0.01)


def test_one_that_is_too_fast_is_told_and_changes_nothing() -> None:
    head = Head()
    head.send((0.5, 1.0), time=0.2)
    head.send((2.0, 0.1), time=2.0)
    assert "a trajectory was refused: joint 'pan' would move at" in head.controller.note
    assert head.at == pytest.approx(0.5, abs=0.01)


def test_it_ends_the_goal_that_leads() -> None:
    head = Head()
    ends: list[Ended[Any]] = []
    client = head.robot.bus.action_client("me", "/head/move", MoveJoints)
    client(MoveJoints.Goal(joints=("pan",), positions=np.array([1.0]), duration=to_duration(2.0)), ends.append)
    head.robot.advance(0.5)
    head.send((0.0, 1.0), time=2.0)
    assert [end.outcome for end in ends] == [Outcome.ABORTED]
    assert ends[0].result is not None
    assert "joint_trajectory" in ends[0].result.message
    assert head.at == pytest.approx(0.0, abs=0.01)
