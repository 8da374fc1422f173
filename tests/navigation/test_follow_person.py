"""Robots that follow somebody, in virtual time."""

from __future__ import annotations

import math
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import map_files
from rbxcompose.domains.worlds.world import world_of
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import pose_in
from rbxcompose.msgs.rbxcompose_msgs import FollowPerson, World
from rbxcompose.msgs.std_msgs import Bool, Float32, Header, String
from rbxcompose.msgs.visualization_msgs import Marker, MarkerArray
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.navigation.houses import room
from tests.parts.project import Project

DOOR = room((-0.1, -3.0, 0.1, -0.6), (-0.1, 0.6, 0.1, 3.0))
ROBOT = """body: {urdf: rbx:robots/turtlebot/turtlebot.urdf}
world: ../../room.yaml
components:
  base: {type: diff_drive_sim, rate: 25 Hz}
  laser: {type: laser_sim, frame: base_link, noise: 1 cm, rays: 240}
"""
NAVIGATION = """navigation: {people: {patience: 3 s}}
muxes:
  cmd_vel:
    inputs:
      navigation: {from: go_to, priority: 10, timeout: 0.5 s}
      following: {from: follow_person, priority: 12, timeout: 0.5 s}
"""
ALONE = """  people: {type: people_tracker, frame: base_link}
  follow_person: {type: person_follower, frame: base_link, patience: 3 s}
"""
WORLD = """rbx: 1
kind: World
name: room
map: door.yaml
objects: {OBJECTS}
spawn:
  west: {x: -2.2 m, y: 0 m}
"""
Way = tuple[tuple[float, float, float], ...]


class Companions:
    """A robot in two rooms with a door between them, and those who walk there: (time [s], x, y [m])."""

    def __init__(self, folder: Path, *ways: Way, more: str = ALONE) -> None:
        for name, data in map_files(DOOR, "door").items():
            folder.joinpath(name).write_bytes(data)
        paths = [", ".join(f"[{time} s, {x} m, {y} m]" for time, x, y in way) for way in ways]
        people = ", ".join(f"person{number}: {{shape: person, path: [{path}]}}" for number, path in enumerate(paths))
        folder.joinpath("room.yaml").write_text(WORLD.replace("OBJECTS", people), encoding="utf-8")
        checked = Project(folder).check(ROBOT + more)
        assert checked.compilation.plan, checked.text
        self.bench = Bench(plan=checked.compilation.plan)
        self.truth = self.bench.collect("/ground_truth", Odometry)
        self.worlds = self.bench.collect("/world", World, Qos.LATCHED)
        self.ends: list[Ended[Any]] = []
        self.feedback: list[FollowPerson.Feedback] = []
        self.speeds_at_contact: list[float] = []
        self.bench.bus.subscribe("me", "/contact", String, Qos.EVENT, self._touched)
        self.client = self.bench.bus.action_client("me", "/follow_person", FollowPerson)

    def _touched(self, message: String) -> None:
        self.speeds_at_contact.append(self.speed)

    @property
    def speed(self) -> float:
        return float(self.truth[-1].twist.twist.linear.x)

    def follow(self, goal: FollowPerson.Goal) -> None:
        self.bench.advance(1.0)
        self.goal = self.client(goal, self.ends.append, self.feedback.append)

    def distance(self, number: int = 0) -> float:
        """Return how far somebody really is [m]."""
        at = pose_in(self.truth[-1].pose.pose)
        return at.distance(world_of(self.worlds[-1]).shapes[number].pose_at(self.bench.clock.now()))

    def reason(self) -> str:
        """Return why the goal failed."""
        return str(self.ends[0].result.message) if self.ends[0].result else ""

    def end(self, most: float = 60.0) -> tuple[Outcome, str]:
        assert self.bench.run_until(lambda: bool(self.ends), most)
        result = self.ends[0].result
        return self.ends[0].outcome, str(result.outcome) if result else ""


THROUGH: Way = ((0, -1.0, 0), (1, -1.0, 0), (11, 1.3, 0.2))
PHYSICS = pytest.param(
    ALONE + "simulator: physics\n",
    marks=[pytest.mark.soak, pytest.mark.skipif(not find_spec("mujoco"), reason="no MuJoCo")],
)


@pytest.mark.parametrize("more", [ALONE, PHYSICS], ids=["ideal", "physics"])
def test_it_follows_somebody_through_a_door_and_keeps_its_distance(tmp_path: Path, more: str) -> None:
    both = Companions(tmp_path, THROUGH, more=more)
    both.follow(FollowPerson.Goal(duration=13.0))
    distances = []
    while not both.ends:
        both.bench.advance(0.2)
        distances.append(both.distance())
    assert both.end() == (Outcome.SUCCEEDED, "")
    assert min(distances) > 0.6
    assert max(distances) < 1.8
    assert both.speeds_at_contact == []
    assert {each.state for each in both.feedback} == {"stands", "follows"}
    assert abs(both.speed) < 0.02


def test_it_stands_while_somebody_walks_at_it(tmp_path: Path) -> None:
    both = Companions(tmp_path, ((0, -1.0, 0), (1, -1.0, 0), (4, 0.5, 0), (7, -2.2, 0)))
    both.follow(FollowPerson.Goal())
    nearest = math.inf
    while both.bench.clock.now() < 7:
        both.bench.advance(0.1)
        nearest = min(nearest, both.distance())
    assert nearest < 0.6  # who walks on into a robot touches it all the same
    assert all(abs(speed) < 0.02 for speed in both.speeds_at_contact)


@pytest.mark.soak  # `test_people` has two who cross
def test_it_keeps_to_the_one_whom_it_began_with(tmp_path: Path) -> None:
    one: Way = ((0, -1.0, -0.3), (4, -1.0, -0.3), (12, -1.0, 2.3), (30, -1.0, 2.3))
    other: Way = ((0, -0.3, 2.4), (4, -0.3, 2.4), (11, -0.4, -2.2), (30, -0.4, -2.2))
    both = Companions(tmp_path, one, other)
    both.follow(FollowPerson.Goal(duration=18.0))
    assert both.end() == (Outcome.SUCCEEDED, "")
    assert len({each.person for each in both.feedback}) == 1
    assert both.distance(0) < 1.4
    assert both.speeds_at_contact == []


def test_who_vanishes_is_searched_where_it_was_and_lost(tmp_path: Path) -> None:
    both = Companions(tmp_path, ((0, -1.0, 0), (2, -1.0, 0), (9, 1.0, 0.0), (9.1, 40, 40)))
    both.follow(FollowPerson.Goal())
    assert both.end() == (Outcome.ABORTED, "lost")
    assert "was not seen again within 3 s" in both.reason()
    states = [each.state for each in both.feedback]
    assert list(dict.fromkeys(states)) == ["stands", "follows", "searches", "waits"]
    assert pose_in(both.truth[-1].pose.pose).distance(Pose2(1.0, 0.0)) < 0.6
    assert abs(both.speed) < 0.02


@pytest.mark.soak
def test_it_is_done_when_somebody_stands_still_at_a_place_or_a_goal_is_canceled(tmp_path: Path) -> None:
    both = Companions(tmp_path, ((0, -1.0, 0), (2, -1.0, 0), (12, 1.5, 0.0)), more=NAVIGATION)
    both.follow(FollowPerson.Goal(until=PoseStamped(Header(frame_id="map"), Pose(Point(1.5, 0.0)))))
    assert both.end() == (Outcome.SUCCEEDED, "")
    assert both.bench.clock.now() > 13
    both.ends.clear()
    both.follow(FollowPerson.Goal())
    both.bench.advance(0.5)
    both.goal.cancel()
    assert both.end() == (Outcome.CANCELED, "")
    assert abs(both.speed) < 0.02


def test_nobody_is_followed_where_nobody_is_and_nonsense_is_refused(tmp_path: Path) -> None:
    both = Companions(tmp_path, ((0, 40, 40),))
    both.follow(FollowPerson.Goal())
    assert both.end() == (Outcome.ABORTED, "nobody")
    for goal in (
        FollowPerson.Goal(distance=math.nan),
        FollowPerson.Goal(patience=-1.0),
        FollowPerson.Goal(until=PoseStamped(Header(frame_id="moon"))),
    ):
        both.ends.clear()
        both.follow(goal)
        assert both.end()[0] is Outcome.REJECTED


def test_missions_and_viewers_see_who_walks(tmp_path: Path) -> None:
    both = Companions(tmp_path, ((0, -1.0, -2.0), (4, -1.0, 1.0)), more=NAVIGATION)
    seen, away = both.bench.collect("/person_seen", Bool), both.bench.collect("/person_distance", Float32)
    shown, poses = both.bench.collect("/people_markers", MarkerArray), both.bench.collect("/person", PoseStamped)
    both.bench.advance(3.0)
    assert not seen[0].data
    assert away[0].data == 6.0
    assert seen[-1].data
    assert away[-1].data == pytest.approx(both.distance(), abs=0.15)
    assert poses[-1].header.frame_id == "map"
    first, *drawn = shown[-1].markers
    assert first.action == Marker.DELETEALL
    assert [marker.type for marker in drawn] == [Marker.LINE_STRIP, Marker.TEXT_VIEW_FACING]
    assert drawn[0].points[0] == drawn[0].points[-1]  # a closed line


def test_without_scans_it_stops_within_the_deadline_and_says_why(tmp_path: Path) -> None:
    both = Companions(tmp_path, ((0, -1.0, 0), (0.5, -1.0, 0), (10.5, 2.0, 0.0)))
    both.follow(FollowPerson.Goal())
    both.bench.advance(3.0)
    assert both.speed > 0.15
    laser: Any = both.bench.component("laser")
    laser.seen = None  # it sees nothing any more, and is silent
    both.bench.advance(1.6)
    assert abs(both.speed) < 0.02
    assert both.end(10.0) == (Outcome.ABORTED, "")
    assert "the laser on 'scan' is silent" in both.reason()


def test_after_a_stop_it_does_not_drive_on_by_itself(tmp_path: Path) -> None:
    both = Companions(tmp_path, ((0, -1.0, 0), (0.5, -1.0, 0), (10.5, 2.0, 0.0)))
    both.follow(FollowPerson.Goal())
    both.bench.advance(3.0)
    assert both.speed > 0.15
    both.bench.host.stop()
    both.bench.advance(1.0)
    assert abs(both.speed) < 0.02
    both.bench.host.release()
    both.bench.advance(3.0)
    assert abs(both.speed) < 0.02
    assert both.ends
