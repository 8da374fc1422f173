"""An arm with simulated servos follows a point with its tip and its head, rests when it is far, and loses it."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from rbxcompose.compiler.plan.model import Instance
from rbxcompose.msgs.geometry_msgs import Point, PointStamped
from rbxcompose.msgs.rbxcompose_msgs import FollowPoint, MoveArm
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import Outcome
from rbxcompose.testing import Bench
from tests.components.slow_servos import with_slow_servos
from tests.shipped import robot_and_plan
from tests.soak import rare

TYPES = ("arm", "head", "arm_tracker", "scene", "servo_bus", "transforms")
BASE = "right_arm_base_link"  # the frame of all points here
AHEAD = {"pi_robot": 0.24, "pedestal_pi": 0.24, "porter": 0.77}  # where the tip gets easily [m]
Place = tuple[float, float, float]


@cache
def parts_of(robot: str) -> list[Instance]:
    _, plan = robot_and_plan(robot, "tracking")
    return [instance for instance in with_slow_servos(plan.instances) if instance.type in TYPES]


@pytest.fixture(scope="module")
def parts() -> list[Instance]:
    return parts_of("pi_robot")


class Chased:
    """A robot whose arm is bent and follows a point."""

    def __init__(self, parts: list[Instance], patience: float = 1.0) -> None:
        self.bench = Bench(*parts)
        self.ends: list[Any] = []
        self.told: list[FollowPoint.Feedback] = []
        self.bench.advance(0.5)
        self._done(MoveArm, "/right_arm/move", MoveArm.Goal(pose="ready"))
        self.begin(patience)

    def begin(self, patience: float = 1.0) -> None:
        """Let the arm follow."""
        self.ends.clear()
        client = self.bench.bus.action_client("me", "/chase/follow", FollowPoint)
        self.goal = client(FollowPoint.Goal(patience=patience), self.ends.append, self.told.append)

    def _done(self, action: Any, topic: str, goal: Any) -> None:
        ends: list[Any] = []
        self.bench.bus.action_client("me", topic, action)(goal, ends.append)
        assert self.bench.run_until(lambda: bool(ends), 30.0)
        assert ends[0].outcome is Outcome.SUCCEEDED

    def show(self, *places: Place, frame: str = BASE, each: float = 0.1) -> None:
        """Tell where the point is, again and again."""
        for x, y, z in places:
            self.bench.publish("/target", PointStamped(header=Header(frame_id=frame), point=Point(x=x, y=y, z=z)))
            self.bench.advance(each)

    @property
    def tip(self) -> Place:
        """Return where the tip is in the frame of the base of its arm [m]."""
        arm: Any = self.bench.component("right_arm")
        poses = arm.works.kinematics.poses(np.array([arm.measured[name][0] for name in arm.works.space.names]))
        found: Place = poses[BASE].inverse().compose(poses["right_arm_tip"]).translation
        return found


@pytest.mark.parametrize("robot", ["pi_robot", *rare("pedestal_pi", "porter")])
def test_the_tip_and_the_head_follow_until_the_point_is_lost(robot: str) -> None:
    chased, ahead = Chased(parts_of(robot)), AHEAD[robot]
    there = (ahead, 0.01, -0.05)
    chased.show(*[there] * 18)
    assert math.dist(chased.tip, there) < 0.03
    assert chased.told[-1].state == "there"
    circle = [(ahead, 0.08 * math.sin(step / 15), -0.05) for step in range(25)]
    chased.show(*circle)
    assert math.dist(chased.tip, circle[-1]) < 0.06
    head: Any = chased.bench.component("head")
    root = head.body.poses(head.positions)[BASE].apply(circle[-1])
    assert head.gaze.angle(root, head.positions) < math.radians(6)
    assert chased.ends == []
    chased.bench.advance(1.2)
    assert (chased.ends[0].outcome, chased.ends[0].result.outcome) == (Outcome.ABORTED, "lost")
    assert "no point has come on 'target'" in chased.ends[0].result.message


@pytest.mark.parametrize("robot", ["pi_robot", "pedestal_pi", "porter"])
@pytest.mark.soak
def test_a_point_that_hardly_moves_is_where_it_was(robot: str) -> None:
    chased, ahead = Chased(parts_of(robot)), AHEAD[robot]
    there = (ahead, 0.01, -0.05)
    chased.show(*[there] * 30)
    at = chased.tip
    chased.show(*[(there[0], there[1] + 0.009, there[2])] * 20)
    assert math.dist(chased.tip, at) < 1e-3
    moved = (there[0], there[1] + 0.04, there[2])
    chased.show(*[moved] * 20)
    assert math.dist(chased.tip, moved) < 0.03


@pytest.mark.parametrize("robot", ["pi_robot", "pedestal_pi", "porter"])
@pytest.mark.soak
def test_far_points_are_reached_for_and_very_far_ones_let_the_arm_rest_until_they_are_back(robot: str) -> None:
    chased, ahead = Chased(parts_of(robot)), AHEAD[robot]
    follows: Any = chased.bench.component("chase").config
    chased.show(*[(ahead + 0.5, -0.1, -0.25)] * 40)
    assert math.dist(chased.tip, follows.shoulder) == pytest.approx(0.9 * follows.length, abs=0.05)
    chased.show(*[(3.0, 0.0, -0.25)] * 60)
    assert chased.told[-1].state == "far"
    arm: Any = chased.bench.component("right_arm")
    resting = arm.config.poses["resting"]
    assert max(abs(arm.measured[name][0] - resting[name]) for name in arm.works.space.names) < 0.03
    assert chased.ends == []


def test_it_comes_to_rest_when_it_is_cancelled(parts: list[Instance]) -> None:
    chased = Chased(parts)
    chased.show(*[(0.24, 0.1, 0.0)] * 5)
    chased.goal.cancel()
    chased.bench.advance(0.6)
    assert chased.ends[0].outcome is Outcome.CANCELED
    at = chased.tip
    chased.show(*[(0.24, -0.1, -0.05)] * 5)
    assert math.dist(chased.tip, at) < 2e-3


def test_what_is_no_point_is_told_once_and_does_not_count(parts: list[Instance]) -> None:
    chased = Chased(parts)
    for frame, place, said in (
        ("map", (0.2, 0.0, -0.05), "the point is in 'map', and expected in 'right_arm_base_link'"),
        (BASE, (math.nan, 0.0, -0.05), "the point is not finite"),
    ):
        chased.show(*[place] * 15, frame=frame)
        assert chased.ends[0].result.message == said
        assert len([text for text in chased.bench.texts() if said in text and "left out" in text]) == 1
        chased.begin()
