"""An arm with simulated servos follows a point with its tip and its head, rests when it is far, and loses it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rbxcompose.compiler import compile_robot
from rbxcompose.msgs.geometry_msgs import Point, PointStamped
from rbxcompose.msgs.rbxcompose_msgs import FollowPoint, MoveArm, TipPoint, TraceArm
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.plan.model import Instance
from rbxcompose.sdk.bound import Outcome
from rbxcompose.testing import Bench
from tests.conftest import ROOT

TYPES = ("arm", "head", "arm_tracker", "scene", "servo_bus", "transforms")
SHOULDER = (0.0, -0.013, 0.55)  # about, in the frame of the torso
Place = tuple[float, float, float]


@pytest.fixture(scope="module")
def parts() -> list[Instance]:
    plan = compile_robot(str(ROOT / "robots/pi_robot"), profiles=["tracking"], environment={}).plan
    assert plan
    return [one for one in plan.instances if one.type in TYPES]


class Chased:
    """A robot whose arm is bent and follows a point."""

    def __init__(self, parts: list[Instance], patience: float = 1.0) -> None:
        self.bench = Bench(*parts)
        self.ends: list[Any] = []
        self.told: list[FollowPoint.Feedback] = []
        self.bench.advance(0.5)
        self._done(MoveArm, "/right_arm/move", MoveArm.Goal(pose="straight_forward"))
        bend = TraceArm.Goal(points=(TipPoint(x=-0.06),), relative=True, any_orientation=True)
        self._done(TraceArm, "/right_arm/trace", bend)
        client = self.bench.bus.action_client("me", "/chase/follow", FollowPoint)
        self.goal = client(FollowPoint.Goal(patience=patience), self.ends.append, self.told.append)

    def _done(self, action: Any, topic: str, goal: Any) -> None:
        ends: list[Any] = []
        self.bench.bus.action_client("me", topic, action)(goal, ends.append)
        assert self.bench.run_until(lambda: bool(ends), 30.0)
        assert ends[0].outcome is Outcome.SUCCEEDED

    def show(self, *places: Place, frame: str = "torso_link", each: float = 0.1) -> None:
        """Tell where the point is, again and again."""
        for x, y, z in places:
            self.bench.publish("/target", PointStamped(header=Header(frame_id=frame), point=Point(x=x, y=y, z=z)))
            self.bench.advance(each)

    @property
    def tip(self) -> Place:
        """Return where the tip is in the frame of the torso [m]."""
        arm: Any = self.bench.component("right_arm")
        poses = arm.works.kinematics.poses(np.array([arm.measured[one][0] for one in arm.works.space.names]))
        found: Place = poses["torso_link"].inverse().compose(poses["right_arm_tip"]).translation
        return found


def test_the_tip_and_the_head_follow_until_the_point_is_lost(parts: list[Instance]) -> None:
    chased = Chased(parts)
    there = (0.24, 0.0, 0.5)
    chased.show(*[there] * 40)
    assert math.dist(chased.tip, there) < 0.03
    assert chased.told[-1].state == "there"
    circle = [(0.24, 0.08 * math.sin(step / 15), 0.5) for step in range(60)]
    chased.show(*circle)
    assert math.dist(chased.tip, circle[-1]) < 0.06
    head: Any = chased.bench.component("head")
    root = head.body.poses({})["torso_link"].apply(circle[-1])
    assert head.gaze.angle(root, head.positions) < math.radians(6)
    assert chased.ends == []
    chased.bench.advance(1.2)
    assert (chased.ends[0].outcome, chased.ends[0].result.outcome) == (Outcome.ABORTED, "lost")
    assert "nothing has told on 'target'" in chased.ends[0].result.message


def test_far_points_are_reached_for_and_very_far_ones_let_the_arm_rest_until_they_are_back(
    parts: list[Instance],
) -> None:
    chased = Chased(parts)
    chased.show(*[(0.7, -0.1, 0.3)] * 40)
    assert math.dist(chased.tip, SHOULDER) == pytest.approx(0.36, abs=0.05)
    chased.show(*[(3.0, 0.0, 0.3)] * 80)
    assert chased.told[-1].state == "far"
    arm: Any = chased.bench.component("right_arm")
    assert max(abs(arm.measured[one][0]) for one in arm.works.space.names) < 0.03
    assert chased.ends == []


def test_it_comes_to_rest_when_it_is_cancelled(parts: list[Instance]) -> None:
    chased = Chased(parts)
    chased.show(*[(0.24, 0.1, 0.55)] * 5)
    chased.goal.cancel()
    chased.bench.advance(1.0)
    assert chased.ends[0].outcome is Outcome.CANCELED
    at = chased.tip
    chased.show(*[(0.24, -0.1, 0.5)] * 10)
    assert math.dist(chased.tip, at) < 2e-3


@pytest.mark.parametrize(
    ("frame", "place", "said"),
    [
        ("map", (0.2, 0.0, 0.5), "the point is in 'map', and expected in 'torso_link'"),
        ("torso_link", (math.nan, 0.0, 0.5), "the point is not finite"),
    ],
)
def test_what_is_no_point_is_told_once_and_does_not_count(
    parts: list[Instance], frame: str, place: Place, said: str
) -> None:
    chased = Chased(parts)
    chased.show(*[place] * 15, frame=frame)
    assert chased.ends[0].result.message == said
    assert len([text for text in chased.bench.texts() if said in text and "left out" in text]) == 1
