"""A base follows a tag: by its law, and through camera and detector in both simulators."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.domains.vision.components.tag_follower import (
    ASIDE,
    TURN_ACCELERATION,
    Following,
    TagFollowerConfig,
    wanted,
)
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseWithCovariance, Twist
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.rbxcompose_msgs import FollowTag
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.vision_msgs import (
    BoundingBox3D,
    Detection3D,
    Detection3DArray,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
)
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.navigation.test_eyes import LEVEL
from tests.navigation.test_robot import Room
from tests.navigation.test_sensors import SELDOM_PHYSICS, skip_without_pictures
from tests.parts.project import Project

SETTINGS = TagFollowerConfig()
DT = 0.05
AWAY, BEARINGS = st.floats(0.05, 8), st.floats(-math.pi, math.pi)


@given(AWAY, BEARINGS)
def test_it_drives_towards_its_distance_within_its_limits_and_turns_to_the_tag(distance: float, bearing: float) -> None:
    velocity = wanted(SETTINGS, SETTINGS.distance, distance, bearing)
    assert -SETTINGS.back_speed <= velocity.linear <= SETTINGS.speed
    assert abs(velocity.angular) <= SETTINGS.turn_rate
    assert velocity.linear * (distance - SETTINGS.distance) >= 0
    assert velocity.angular * bearing >= 0
    if abs(bearing) > ASIDE:
        assert velocity.linear == 0


@given(st.lists(st.tuples(AWAY, BEARINGS), min_size=1, max_size=40), st.floats(0.02, 0.2))
def test_its_accelerations_are_limited_and_without_a_tag_it_comes_to_rest(
    seen: list[tuple[float, float]], dt: float
) -> None:
    following = Following()
    for distance, bearing in seen:
        last = following.velocity
        now = following.towards(SETTINGS, SETTINGS.distance, distance, bearing, dt)
        assert abs(now.linear - last.linear) <= SETTINGS.acceleration * dt + 1e-9
        assert abs(now.angular - last.angular) <= TURN_ACCELERATION * dt + 1e-9
    last = following.velocity
    for _ in range(math.ceil(2.0 / dt)):
        now = following.without(dt)
        assert abs(now.linear) <= abs(last.linear)
        last = now
    assert (now.linear, now.angular) == (0.0, 0.0)


@given(st.floats(0.3, 3), st.floats(-1, 1))
def test_it_comes_to_its_distance_and_faces_the_tag(x: float, y: float) -> None:
    following, at = Following(), np.array((0.0, 0.0, 0.0))
    for _ in range(600):
        dx, dy = x - at[0], y - at[1]
        bearing = math.remainder(math.atan2(dy, dx) - at[2], math.tau)
        velocity = following.towards(SETTINGS, SETTINGS.distance, math.hypot(dx, dy), bearing, DT)
        at += DT * np.array((velocity.linear * math.cos(at[2]), velocity.linear * math.sin(at[2]), velocity.angular))
    assert abs(math.hypot(x - at[0], y - at[1]) - SETTINGS.distance) <= SETTINGS.tolerance + 0.03
    assert abs(math.remainder(math.atan2(y - at[1], x - at[0]) - at[2], math.tau)) <= SETTINGS.bearing + 0.03


ROBOT = """body: {urdf: eye.urdf}
world: ../../room.yaml
simulator: SIMULATOR
cameras:
  front: {frame: camera_link, size: [320, 240], rate: 5 Hz}
tags: {size: 24 cm, names: {walker: 7}}
components:
  base: {type: diff_drive_sim, rate: 25 Hz}
  follower: {type: tag_follower, frame: camera_optical_frame, tag: walker, always: true, distance: 1 m}
"""
WORLD = """rbx: 1
kind: World
name: room
objects:
  walker:
    shape: person
    path: [[0 s, 1.5 m, 0 m], [1 s, 1.5 m, 0 m], [5 s, 2.6 m, 40 cm], [8 s, 3.2 m, 1.2 m]]
    turns: true
    tags: {back: {number: 7, size: 24 cm, up: -45 cm}}
"""


@SELDOM_PHYSICS
def test_it_keeps_its_distance_to_somebody_who_walks(tmp_path: Path, simulator: str) -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed")
    if simulator == "physics":
        pytest.importorskip("mujoco", reason="mujoco is not installed")
    (tmp_path / "robots/one").mkdir(parents=True)
    (tmp_path / "robots/one/eye.urdf").write_text(LEVEL)
    bench = Room(tmp_path, ROBOT.replace("SIMULATOR", simulator), WORLD).bench
    taken = bench.collect("/tags", Detection3DArray)
    truth, contacts = bench.collect("/ground_truth", Odometry), bench.collect("/contact", String)
    bench.advance(1.0)
    skip_without_pictures(bench, simulator, taken)
    bench.advance(11.0)
    at = truth[-1].pose.pose.position
    back = 3.2 - 0.25 * math.cos(math.atan2(0.8, 0.6)), 1.2 - 0.25 * math.sin(math.atan2(0.8, 0.6))
    assert math.dist((at.x, at.y), back) == pytest.approx(1.0, abs=0.15)
    assert not contacts


def tag(name: str, x: float, y: float = 0.0, score: float = 1.0, number: str = "") -> Detection3D:
    pose = Pose(Point(x, y, 0.0))
    names = filter(None, (name, number))
    hypotheses = (ObjectHypothesis(each, score) for each in names)
    results = tuple(ObjectHypothesisWithPose(each, PoseWithCovariance(pose, np.zeros(36))) for each in hypotheses)
    return Detection3D(Header(), results, BoundingBox3D(center=pose), name)


class Follower:
    """A base that follows tags, which a test tells in the frame of the base."""

    def __init__(self, folder: Path, more: str = "") -> None:
        checked = Project(folder).check(
            "components:\n  base: {type: diff_drive_sim}\n"
            f"  follower: {{type: tag_follower, frame: base_footprint, patience: 1 s{more}}}\n"
        )
        assert checked.compilation.plan, checked.text
        self.bench = Bench(plan=checked.compilation.plan)
        self.sent = self.bench.collect("/cmd_vel", Twist, Qos.COMMAND)
        self.statuses = self.bench.statuses("follower")
        self.ends: list[Ended[Any]] = []
        self.bench.advance(0.5)

    def see(self, *tags: Detection3D, seconds: float = 1.0, frame: str = "base_footprint") -> float:
        """Show tags for a time [s], and return the speed at its end [m/s]."""
        for _ in range(round(seconds / 0.1)):
            self.bench.publish("/tags", Detection3DArray(Header(frame_id=frame), tags), Qos.STATE)
            self.bench.advance(0.1)
        return self.sent[-1].linear.x if self.sent else 0.0

    def ask(self, **goal: Any) -> None:
        client = self.bench.bus.action_client("me", "/follow_tag", FollowTag)
        client(FollowTag.Goal(**goal), self.ends.append)


@pytest.mark.parametrize("asked", ["box", "7"])
def test_a_goal_is_followed_by_name_or_number_until_its_time_is_over(tmp_path: Path, asked: str) -> None:
    follower, box = Follower(tmp_path), tag("box", 3.0, number="7")
    assert follower.see(box) == 0.0
    follower.ask(tag=asked, duration=2.0)
    assert follower.see(box, tag("other", 1.0, 1.0)) > 0.3
    follower.see(box, seconds=1.5)
    assert [end.outcome for end in follower.ends] == [Outcome.SUCCEEDED]
    assert follower.sent[-1] == Twist()


@pytest.mark.parametrize(("first", "outcome"), [(tag("box", 3.0), "lost"), (tag("other", 3.0), "not_seen")])
def test_without_the_tag_it_slows_down_and_the_goal_fails(tmp_path: Path, first: Detection3D, outcome: str) -> None:
    follower = Follower(tmp_path)
    follower.ask(tag="box")
    follower.see(first)
    speeds = [follower.see(seconds=0.2) for _ in range(12)]
    assert all(after <= before for before, after in pairwise(speeds[3:]))
    assert speeds[-1] == 0.0
    (end,) = follower.ends
    assert end.result is not None
    assert (end.outcome, end.result.outcome) == (Outcome.ABORTED, outcome)


def test_a_camera_that_freezes_stops_it_at_once(tmp_path: Path) -> None:
    follower = Follower(tmp_path, ", always: true")
    assert follower.see(tag("box", 3.0)) > 0.3
    follower.bench.advance(0.7)
    assert follower.sent[-1] == Twist()
    follower.bench.advance(1.5)
    assert follower.statuses[-1].level == Level.WARN
    assert follower.statuses[-1].message.startswith("the camera has told nothing for")


@pytest.mark.parametrize("wrong", [tag("box", math.nan), tag("box", 3.0, score=0.0), Detection3D(id="box")])
def test_what_is_nowhere_is_not_followed(tmp_path: Path, wrong: Detection3D) -> None:
    assert Follower(tmp_path, ", always: true").see(wrong) == 0.0


def test_tags_of_another_camera_are_reported(tmp_path: Path) -> None:
    follower = Follower(tmp_path, ", always: true")
    assert follower.see(tag("box", 3.0), seconds=2.0, frame="elsewhere") == 0.0
    assert follower.statuses[-1].message == "tags are in 'elsewhere', and expected in 'base_footprint'"


def test_of_two_with_one_name_it_follows_the_one_that_was_there(tmp_path: Path) -> None:
    follower = Follower(tmp_path, ", always: true, speed: 0.06 m/s")
    follower.see(tag("box", 3.0))
    follower.see(tag("box", 2.9), tag("box", 0.5, 0.5), seconds=2.0)
    assert follower.sent[-1].angular.z == 0.0


def test_a_goal_that_is_no_number_is_refused(tmp_path: Path) -> None:
    follower = Follower(tmp_path)
    follower.ask(distance=math.nan)
    follower.bench.advance(0.2)
    assert [end.outcome for end in follower.ends] == [Outcome.REJECTED]
