"""Robots that follow somebody who wears tags, through the house, in both simulators and in virtual time."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rbxcompose.base.levels import Level
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.worlds.shapes import ShapePath
from rbxcompose.domains.worlds.world import world_of
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseWithCovariance, Quaternion
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.people_msgs import People
from rbxcompose.msgs.rbxcompose_msgs import World
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.vision_msgs import (
    BoundingBox3D,
    Detection3D,
    Detection3DArray,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
)
from rbxcompose.sdk.component import MissionOver
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.conftest import ROOT
from tests.navigation.test_sensors import SIMULATORS, skip_without_pictures
from tests.parts.project import Project

pytestmark = pytest.mark.timeout(120)
pytest.importorskip("cv2", reason="OpenCV is not installed")
ROBOT = """body: {urdf: rbx:robots/turtlebot/turtlebot.urdf}
components:
  base: {type: diff_drive_sim}
  people: {type: tagged_people, frame: base_link, stands_in: odom, tags: [guide], behind: 20 cm}
"""
TOWARDS = Quaternion(-0.5, -0.5, 0.5, 0.5)  # of a tag in `base_link`: it faces the robot


@SIMULATORS
@pytest.mark.soak
def test_the_robot_keeps_its_distance_to_a_guide_through_the_house(simulator: str) -> None:
    if simulator == "physics":
        pytest.importorskip("mujoco", reason="mujoco is not installed")
    sets = (f"simulator={simulator}",)
    plan = compile_robot(str(ROOT / "robots/house"), profiles=["tagged"], sets=sets, environment={}).plan
    assert plan is not None
    bench = Bench(plan=plan)
    truth, contacts = bench.collect("/ground_truth", Odometry), bench.collect("/contact", String)
    told, worlds = bench.collect("/people", People), bench.collect("/world", World, Qos.LATCHED)
    bench.advance(1.0)
    skip_without_pictures(bench, simulator, told[-1].people)
    (guide,) = (shape for shape in world_of(worlds[-1]).shapes if shape.path is not None)
    path = guide.path
    assert isinstance(path, ShapePath)
    away: list[float] = []
    while not (over := [event for event in bench.events if isinstance(event, MissionOver)]) and bench.clock.now() < 60:
        bench.advance(0.5)
        at = truth[-1].pose.pose.position
        away.append(math.dist((at.x, at.y), path.place_at(bench.clock.now())))
        for one in told[-1].people:
            assert math.dist((one.position.x, one.position.y), path.place_at(bench.clock.now())) < 0.25
    assert [event.outcome for event in over] == ["success"]
    assert not contacts
    assert 0.7 < min(away) < max(away) < 2.5
    assert away[-1] == pytest.approx(1.0, abs=0.25)


def tag(name: str, x: float, y: float, score: float = 1.0, turn: Quaternion = TOWARDS) -> Detection3D:
    pose = Pose(Point(x, y, 0.0), turn)
    result = ObjectHypothesisWithPose(ObjectHypothesis(name, score), PoseWithCovariance(pose, np.zeros(36)))
    return Detection3D(Header(), (result,), BoundingBox3D(center=pose), name)


class Watcher:
    """A robot that watches people with tags, which a test tells."""

    def __init__(self, folder: Path) -> None:
        checked = Project(folder).check(ROBOT)
        assert checked.compilation.plan, checked.text
        self.bench = Bench(plan=checked.compilation.plan)
        self.told = self.bench.collect("/people", People)
        self.statuses = self.bench.statuses("people")

    def see(self, *tags: Detection3D, frame: str = "base_link") -> list[tuple[str, float, float]]:
        self.bench.publish("/tags", Detection3DArray(Header(frame_id=frame), tags), Qos.STATE)
        self.bench.advance(0.2)
        return [(one.name, one.position.x, one.position.y) for one in self.told[-1].people]


def test_who_wears_a_tag_is_behind_it_by_its_turn_or_by_the_line_of_sight(tmp_path: Path) -> None:
    watcher = Watcher(tmp_path)
    watcher.bench.advance(0.5)
    ((name, x, y),) = watcher.see(tag("guide", 2.0, 0.0), tag("box", 1.0, 0.0))
    assert name == "guide"
    assert (x, y) == pytest.approx((2.2, 0.0))
    watcher.bench.advance(3.0)
    ((_, x, y),) = watcher.see(tag("guide", 0.0, 2.0, score=0.3))
    assert (x, y) == pytest.approx((0.0, 2.2))


@pytest.mark.parametrize(
    "wrong",
    [tag("guide", math.nan, 0.0), tag("guide", 9.0, 0.0), tag("guide", 2.0, 0.0, score=0.0), Detection3D(id="guide")],
)
def test_a_tag_that_is_nowhere_or_too_far_is_nobody(tmp_path: Path, wrong: Detection3D) -> None:
    watcher = Watcher(tmp_path)
    watcher.bench.advance(0.5)
    assert watcher.see(wrong) == []


def test_a_strange_frame_and_a_camera_that_freezes_are_reported(tmp_path: Path) -> None:
    watcher = Watcher(tmp_path)
    watcher.bench.advance(3.0)
    for _ in range(8):
        assert watcher.see(tag("guide", 2.0, 0.0), frame="elsewhere") == []
    assert watcher.statuses[-1].level == Level.WARN
    assert watcher.statuses[-1].message == "tags are in 'elsewhere', and expected in 'base_link'"
    for _ in range(8):
        assert watcher.see(tag("guide", 2.0, 0.0))
    assert watcher.statuses[-1].level == Level.OK
    watcher.bench.advance(3.5)
    assert watcher.told[-1].people == ()
    assert watcher.statuses[-1].message.startswith("the camera has told nothing for")
