"""Robots that drive through worlds, in virtual time."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, Transform3, quaternion_from_rpy
from rbxcompose.base.levels import Level
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveSim
from rbxcompose.domains.navigation.components.navigator import Navigator
from rbxcompose.domains.navigation.planner import PlannedPath
from rbxcompose.domains.worlds.grid_map import map_files
from rbxcompose.domains.worlds.world import grid_of
from rbxcompose.msgs.builtin_interfaces import Duration, Time
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    Twist,
    Vector3,
)
from rbxcompose.msgs.nav2_msgs import BackUp as Nav2BackUp
from rbxcompose.msgs.nav2_msgs import NavigateThroughPoses, NavigateToPose, Spin
from rbxcompose.msgs.nav_msgs import OccupancyGrid, Odometry
from rbxcompose.msgs.nav_msgs import Path as PathMessage
from rbxcompose.msgs.poses import message_of, pose_in
from rbxcompose.msgs.rbxcompose_msgs import BackUp, World
from rbxcompose.msgs.sensor_arrays import level_rays, rays_of
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.visualization_msgs import Marker, MarkerArray
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from rbxcompose.testing.bench import run_robot
from tests.loops import for_all
from tests.navigation.houses import ONE_WALL, is_blocked
from tests.parts.project import Project
from tests.soak import rare

LASER = "  laser: {type: laser_sim, frame: base_link, noise: 5 mm, rays: 180, rate: 5 Hz}\n"
ROBOT = f"""body: {{urdf: rbx:robots/turtlebot/turtlebot.urdf}}
world: ../../room.yaml
components:
  base: {{rate: 25 Hz, type: diff_drive_sim}}
{LASER}navigation:
  follower: {{speed: 0.4 m/s}}
"""
WORLD = """rbx: 1
kind: World
name: room
map: one_wall.yaml
spawn:
  west: {x: -2 m, y: 0 m}
"""
CHAIR = """objects:
  chair:
    box: [40 cm, 40 cm, 80 cm]
    path: [[0 s, 50 cm, 1 m], [1 s, 50 cm, 1 m], [2 s, -1.5 m, 1 m], [100 s, -1.5 m, 1 m]]
"""


class Room:
    """A robot in a room with a wall in its middle."""

    def __init__(self, folder: Path, robot: str = ROBOT, world: str = WORLD) -> None:
        for name, data in map_files(ONE_WALL, "one_wall").items():
            folder.joinpath(name).write_bytes(data)
        folder.joinpath("room.yaml").write_text(world, encoding="utf-8")
        self.checked = Project(folder).check(robot)
        self.bench = Bench(plan=self.checked.plan)
        self.contacts = self.bench.collect("/contact", String)
        self.paths = self.bench.collect("/plan", PathMessage)
        self.feedback: list[Any] = []
        self.ends: list[Ended[Any]] = []
        self.bench.advance(0.5)

    @property
    def base(self) -> DiffDriveSim:
        found = self.bench.component("base")
        assert isinstance(found, DiffDriveSim)
        return found

    def go(self, x: float, y: float, heading: float = 0.0, frame: str = "map", most: float = 90.0) -> Ended[Any]:
        """Send the robot to a pose, and return how that ends."""
        turn = Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))
        goal = NavigateToPose.Goal(pose=PoseStamped(Header(frame_id=frame), Pose(Point(x, y, 0.0), turn)))
        self.ends.clear()
        self.bench.bus.action_client("me", "/go_to", NavigateToPose)(goal, self.ends.append, self.feedback.append)
        assert self.bench.run_until(lambda: bool(self.ends), most)
        return self.ends[0]

    def reason(self) -> str:
        """Return why the last goal failed."""
        return str(self.ends[0].result.error_msg) if self.ends[0].result else ""


def test_it_drives_around_a_wall_and_reports_on_its_way(tmp_path: Path) -> None:
    room = Room(tmp_path)
    costs = room.bench.collect("/global_costmap/costmap", OccupancyGrid)
    assert room.go(2.0, 0.3, 1.0).outcome is Outcome.SUCCEEDED
    assert room.base.core.pose.distance(Pose2(2.0, 0.3)) < 0.1
    assert room.contacts == []
    assert len(room.paths) == 1
    left = [feedback.distance_remaining for feedback in room.feedback]
    assert left[0] > 5
    assert left[-1] < 0.2
    assert max(costs[-1].data) == 100
    room.bench.advance(1.0)
    assert room.base.is_at_rest


def test_a_chair_that_is_pushed_into_the_way_is_driven_around(tmp_path: Path) -> None:
    room = Room(tmp_path, world=WORLD + CHAIR)
    assert room.go(-1.0, 2.0).outcome is Outcome.SUCCEEDED
    assert room.contacts == []
    assert len(room.paths) > 1


def test_a_goal_that_cannot_be_reached_fails_with_the_reason(tmp_path: Path) -> None:
    room = Room(tmp_path)
    assert room.go(0.0, 0.0).outcome is Outcome.ABORTED
    assert room.reason() == "an obstacle is at the goal; it could get within 0.3 m"
    assert room.go(7.0, 0.0).outcome is Outcome.ABORTED
    assert room.reason() == "the goal is outside of the map"
    assert room.go(1.0, 0.0, frame="moon").outcome is Outcome.REJECTED
    assert room.go(math.nan, 0.0).outcome is Outcome.REJECTED
    assert room.go(1e308, 0.0).outcome is Outcome.REJECTED


def test_it_drives_through_poses_without_a_stop(tmp_path: Path) -> None:
    room, speeds = Room(tmp_path), []
    poses = tuple(
        PoseStamped(Header(frame_id="map"), Pose(Point(x, y))) for x, y in ((-1.2, 1.5), (0.0, 2.2), (1.6, 2.0))
    )
    client = room.bench.bus.action_client("me", "/navigate_through_poses", NavigateThroughPoses)
    client(NavigateThroughPoses.Goal(poses=poses), room.ends.append, room.feedback.append)
    nearest = [math.inf] * len(poses)
    while not room.ends and room.bench.clock.now() < 60:
        room.bench.advance(0.1)
        at = room.base.core.pose
        nearest = [min(best, at.distance(pose_in(pose.pose))) for best, pose in zip(nearest, poses, strict=True)]
        if nearest[0] < 0.5 and at.distance(pose_in(poses[-1].pose)) > 0.5:
            speeds.append(room.base.core.velocity.linear)
    assert [end.outcome for end in room.ends] == [Outcome.SUCCEEDED]
    assert max(nearest) <= 0.5
    assert nearest[-1] <= 0.1
    assert min(speeds) > 0.05
    left = [feedback.number_of_poses_remaining for feedback in room.feedback]
    assert sorted(set(left), reverse=True) == [3, 2, 1]
    client(NavigateThroughPoses.Goal(), room.ends.append)
    room.bench.advance(0.2)
    assert room.ends[-1].outcome is Outcome.REJECTED


SHUT = """objects:
  cupboard: {box: [20 cm, 270 cm, 80 cm], at: {x: 0 m, y: -2.3 m}}
  shelf: {box: [20 cm, 270 cm, 80 cm], at: {x: 0 m, y: 2.3 m}}
"""
MINE = """rbx: 1
kind: Mission
name: mine
inputs:
  attempt: {type: count, default: 1}
do:
  choose: $attempt
  cases:
    1: {spin: 90 deg}
    2: {back_up: 20 cm}
  else: {end: failure}
"""


SCANNED = ROBOT.replace(LASER, "").replace(
    "  follower:", "  costs: {obstacles: {from: scan, frame: base_link}}\n  follower:"
)
SCAN = LaserScan(Header(frame_id="base_link"), 0.0, 0.0, 0.1, 0.0, 0.1, 0.1, 9.0, np.full(9, math.inf, np.float32))


@pytest.mark.parametrize(
    ("scan", "said"),
    [
        (replace(SCAN, ranges=np.full(9, math.nan, np.float32)), "none of its numbers is a distance"),
        *(
            pytest.param(scan, "none of its numbers is a distance", marks=pytest.mark.soak)
            for scan in (
                replace(SCAN, ranges=np.zeros(0, np.float32)),
                replace(SCAN, angle_increment=math.nan),
                replace(SCAN, angle_min=math.inf, angle_increment=-math.inf),
                replace(SCAN, range_max=0.0),
            )
        ),
        pytest.param(replace(SCAN, range_max=math.nan), "", marks=pytest.mark.soak),
        (replace(SCAN, header=Header(Time(1 << 30), "base_link")), "known"),
        (replace(SCAN, header=Header(frame_id="base_scan")), "it is in 'base_scan', not in 'base_link'"),
        pytest.param(SCAN, "", marks=pytest.mark.soak),
    ],
)
def test_a_robot_whose_laser_tells_nothing_does_not_drive_blindly(tmp_path: Path, scan: LaserScan, said: str) -> None:
    room = Room(tmp_path, SCANNED)
    start = room.base.core.pose
    room.bench.bus.action_client("me", "/go_to", NavigateToPose)(
        NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), Pose(Point(2.0, 0.3)))), room.ends.append
    )
    for _ in range(250):
        room.bench.publish("/scan", scan)
        room.bench.advance(0.1)
        if room.ends:
            break
    assert room.ends
    if said:
        assert "the laser on 'scan' is of no use" in room.reason()
        assert said in room.reason()
        assert room.base.core.pose == start
    else:
        assert room.ends[0].outcome is Outcome.SUCCEEDED


@pytest.mark.parametrize(
    ("later", "said"), [(0.0, "it comes again and again with the same stamp"), (0.1, "its scans are 2.0 s old")]
)
def test_a_laser_that_hangs_or_comes_late_is_as_good_as_silent(tmp_path: Path, later: float, said: str) -> None:
    room = Room(tmp_path, SCANNED)
    room.bench.advance(2.0)
    room.bench.bus.action_client("me", "/go_to", NavigateToPose)(
        NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), Pose(Point(2.0, 0.3)))), room.ends.append
    )
    stamp = room.bench.clock.now() - (2.0 if later else 0.0)
    while not room.ends:
        room.bench.publish("/scan", replace(SCAN, header=Header(to_time(round(stamp * 1e9)), "base_link")))
        room.bench.advance(0.1)
        stamp += later
    assert room.reason() == f"the laser on 'scan' is of no use: {said}"
    assert room.base.core.distance < 0.5
    assert room.base.is_at_rest


def test_a_manoeuvre_waits_for_the_first_scan_and_without_any_fails_at_once_where_the_robot_stands(
    tmp_path: Path,
) -> None:
    room = Room(tmp_path, SCANNED)

    def back_up() -> None:
        room.ends.clear()
        room.bench.bus.action_client("me", "/back_up", BackUp)(BackUp.Goal(distance=0.2), room.ends.append)
        room.bench.advance(0.2)

    back_up()
    assert not room.ends
    room.bench.advance(1.0)
    for _ in range(2):
        assert room.ends[0].outcome is Outcome.ABORTED
        back_up()
    assert room.bench.texts()[-1].endswith("the laser on 'scan' is silent")
    assert room.base.core.distance == 0.0
    room.bench.publish("/scan", SCAN)
    back_up()
    room.bench.advance(0.5)
    assert room.base.core.distance > 0.0


def test_a_scan_that_comes_before_the_transform_of_its_time_is_taken_with_it(tmp_path: Path) -> None:
    room = Room(tmp_path, SCANNED.replace("rate: 25 Hz, ", ""))
    soon = to_time(room.bench.clock.stamp() + 30_000_000)
    room.bench.publish("/scan", replace(SCAN, header=Header(soon, "base_link"), ranges=np.ones(9, np.float32)))
    navigator: Any = room.bench.component("go_to")
    assert not is_blocked(navigator.costs, -1.0, 0.0)
    room.bench.advance(0.1)
    assert is_blocked(navigator.costs, -1.0, 0.0)


def test_recoveries_are_a_mission_that_users_may_replace(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(MINE, encoding="utf-8")
    east = "places: {east: {x: 2 m, y: 30 cm}}"
    robot = f"{ROBOT}  recoveries: ../../mine.yaml\nmissions: {{walk: ../../walk.yaml}}\n{east}\n"
    (tmp_path / "walk.yaml").write_text("rbx: 1\nkind: Mission\nname: walk\ndo:\n  go_to: east\n", encoding="utf-8")
    room = Room(tmp_path, f"{robot}start: walk\n", WORLD + SHUT)
    assert room.bench.run_until(lambda: any("mission walk: failure" in text for text in room.bench.texts()), 60.0)
    texts = "\n".join(room.bench.texts())
    assert "no way leads to the goal; it could get within 2" in texts
    assert [f"runs mission recover, attempt {number}:" in texts for number in (1, 2, 3, 4)] == [True, True, True, False]
    assert "go_to east: failure" in texts
    assert texts.count("and nothing that was tried has helped") > 1
    assert all(f"recover: {did}: success" in texts for did in ("spin 90 deg", "back_up 20 cm"))
    assert room.contacts == []


def test_a_robot_that_is_held_by_what_its_laser_does_not_see_tries_recoveries(tmp_path: Path) -> None:
    step = "objects:\n  step: {box: [20 cm, 1 m, 5 cm], at: {x: -1 m, y: 0 m}}\n"
    room = Room(tmp_path, SCANNED, WORLD + step)
    room.bench.bus.action_client("me", "/go_to", NavigateToPose)(
        NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), Pose(Point(-0.4, 0.0)))), room.ends.append
    )
    tried = "go_to: runs mission recover, attempt 1: it gets no further"
    for _ in range(300):
        room.bench.publish("/scan", SCAN)
        room.bench.advance(0.1)
    assert room.contacts
    assert tried in room.bench.texts()
    assert not room.ends


def test_what_is_driven_to_and_fro_is_no_progress(tmp_path: Path) -> None:
    navigator = Room(tmp_path).bench.component("go_to")
    assert isinstance(navigator, Navigator)
    path = PlannedPath((Pose2(-2.0, 1.0), Pose2(2.0, 1.0)))
    navigator.poses = [path.poses[-1], Pose2(2.0, 2.0)]

    def attempts_at(*distances: float) -> int:
        for navigator.follower.left in distances:
            navigator.track_progress(path)
        return navigator.attempts

    assert attempts_at(4.0, 3.0) == 0
    navigator.attempts = 1
    assert attempts_at(3.5, 2.8, 3.5, 2.8) == 1
    assert attempts_at(2.6) == 0
    assert navigator.least == 3.6  # with the way to the next pose


def test_manoeuvres_are_skills_of_their_own_and_stop_before_something(tmp_path: Path) -> None:
    room = Room(tmp_path, world=WORLD.replace("-2 m", "-1.4 m"))

    def does(action: str, type_: Any, goal: Any) -> Outcome:
        room.ends.clear()
        room.bench.bus.action_client("me", action, type_)(goal, room.ends.append)
        assert room.bench.run_until(lambda: bool(room.ends), 30.0)
        return room.ends[0].outcome

    assert does("/spin", Spin, Spin.Goal(target_yaw=-math.pi)) is Outcome.SUCCEEDED
    assert abs(abs(room.base.core.pose.heading) - math.pi) < 0.05
    assert does("/back_up", BackUp, BackUp.Goal(distance=0.3)) is Outcome.SUCCEEDED
    assert abs(room.base.core.pose.x + 1.1) < 0.05
    assert does("/back_up", BackUp, BackUp.Goal(distance=2.0)) is Outcome.ABORTED  # the wall is there
    assert room.contacts == []
    assert does("/back_up", BackUp, BackUp.Goal(distance=-1.0)) is Outcome.REJECTED
    assert does("/spin", Spin, Spin.Goal(target_yaw=math.nan)) is Outcome.REJECTED


def test_a_manoeuvre_keeps_the_time_that_it_is_allowed_and_tells_how_far_it_is(tmp_path: Path) -> None:
    room = Room(tmp_path)
    behind = Nav2BackUp.Goal(Point(x=0.3), 0.15)
    soon = Duration(sec=1)
    manoeuvres: list[tuple[str, Any, Any, int, float]] = [
        ("/spin", Spin, Spin.Goal(target_yaw=3.0, time_allowance=soon), Spin.Result.TIMEOUT, 0.0),
        ("/spin", Spin, Spin.Goal(target_yaw=1.0, time_allowance=Duration(sec=5)), 0, 1.0),
        ("/backup", Nav2BackUp, replace(behind, time_allowance=soon), Nav2BackUp.Result.TIMEOUT, 0.0),
        ("/backup", Nav2BackUp, behind, 0, 0.3),
    ]
    for action, type_, goal, code, reached in manoeuvres:
        room.ends.clear()
        room.feedback.clear()
        room.bench.bus.action_client("me", action, type_)(goal, room.ends.append, room.feedback.append)
        assert room.bench.run_until(lambda: bool(room.ends), 10.0)
        result, told = room.ends[0].result, room.feedback
        assert result is not None
        assert result.error_code == code
        elapsed = result.total_elapsed_time.sec + result.total_elapsed_time.nanosec * 1e-9
        assert elapsed == pytest.approx(1.05, abs=0.06) if code else 1.0 < elapsed < 5.0
        done = [getattr(each, "angular_distance_traveled", 0) or each.distance_traveled for each in told[1:]]
        assert all(before <= after for before, after in pairwise(done))
        assert not reached or done[-1] == pytest.approx(reached, abs=0.03)
        room.bench.advance(1.0)
        assert room.base.is_at_rest


def test_a_tree_is_the_name_of_a_mission_that_recovers_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(MINE, encoding="utf-8")
    room = Room(tmp_path, f"{ROBOT}missions: {{mine: ../../mine.yaml}}\n", WORLD + SHUT)
    pose = PoseStamped(Header(frame_id="map"), Pose(Point(2.0, 0.3)))

    def go(tree: str) -> Outcome:
        room.ends.clear()
        room.bench.bus.action_client("me", "/navigate_to_pose", NavigateToPose)(
            NavigateToPose.Goal(pose=pose, behavior_tree=tree), room.ends.append, room.feedback.append
        )
        assert room.bench.run_until(lambda: bool(room.ends), 60.0)
        return room.ends[0].outcome

    assert go("/opt/ros/jazzy/share/nav2_bt_navigator/trees/navigate.xml") is Outcome.REJECTED
    assert go("mine") is Outcome.ABORTED
    texts = "\n".join(room.bench.texts())
    assert "runs mission mine, attempt 1: no way leads to the goal" in texts
    assert "runs mission recover" not in texts
    assert [told.number_of_recoveries for told in room.feedback][-1] == 3
    assert room.feedback[-1].navigation_time.sec > room.feedback[0].navigation_time.sec


def test_viewers_see_zones_and_learn_what_time_it_is_in_the_world(tmp_path: Path) -> None:
    zones = """  costs:
    zones:
      carpet: {area: [[0 m, 0 m], [1 m, 0 m], [1 m, 2 m]], speed: 50 %}
      stairs: {keep_out: [[-2 m, 1 m], [-1 m, 1 m], [-1 m, 2 m]]}
"""
    bench = Room(tmp_path, ROBOT + zones).bench
    shown = bench.collect("/zone_markers", MarkerArray, Qos.LATCHED)
    worlds = bench.collect("/world", World, Qos.LATCHED)
    bench.advance(0.5)
    bench.component("world").activate()  # again, when robot time is no longer that of the start
    bench.advance(0.0)
    first, *markers = shown[0].markers
    assert first.action == Marker.DELETEALL
    assert [(marker.ns, marker.text) for marker in markers if marker.text] == [
        ("speed", "carpet: 50 %"),
        ("keepout", "stairs: keep out"),
    ]
    outlines = [marker for marker in markers if marker.type == Marker.LINE_STRIP]
    assert [(point.x, point.y) for point in outlines[1].points] == [(-2, 1), (-1, 1), (-1, 2), (-2, 1)]
    assert len({(marker.ns, marker.id) for marker in markers}) == 4  # viewers take the same one for the same thing
    assert [world.time for world in worlds] == [0.0, 1.0]


def test_the_tools_of_nav2_drive_it_too_and_the_newest_goal_counts(tmp_path: Path) -> None:
    room = Room(tmp_path)
    goal = NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), Pose(Point(2.0, 0.3))))
    room.bench.bus.action_client("me", "/navigate_to_pose", NavigateToPose)(goal, room.ends.append)
    room.bench.advance(3.0)
    assert room.base.core.velocity.linear > 0.3
    room.bench.publish("/goal_pose", PoseStamped(Header(frame_id="map"), Pose(Point(-2.0, 1.0))), Qos.EVENT)
    assert room.bench.run_until(lambda: room.base.core.pose.distance(Pose2(-2.0, 1.0)) < 0.1, 20.0)
    assert [end.outcome for end in room.ends] == [Outcome.ABORTED]
    assert room.ends[0].result == NavigateToPose.Result(error_code=1, error_msg="replaced by a newer goal")
    room.bench.publish("/goal_pose", PoseStamped(Header(frame_id="map"), Pose(Point(2.0, 0.3))), Qos.EVENT)
    room.bench.advance(2.0)
    assert room.base.core.velocity.linear > 0.1
    room.bench.host.stop()
    room.bench.advance(1.5)
    room.bench.host.release()
    room.bench.advance(2.0)
    assert room.base.is_at_rest  # a stop ends what nobody waits for
    room.bench.publish("/goal_pose", PoseStamped(Header(frame_id="moon")), Qos.EVENT)
    room.bench.advance(0.5)
    assert any("not in 'moon'" in text for text in room.bench.texts())


def test_places_without_room_are_found(tmp_path: Path) -> None:
    things = """objects:
  sofa: {box: [1 m, 1 m, 50 cm], at: {x: 2 m, y: 2 m}}
  lamp: {box: [1 m, 1 m, 10 cm], z: 2 m, at: {x: -1 m}}
"""
    places = """places:
  wall: {x: 0 m, y: 1 m}
  sofa: {x: 2 m, y: 1.4 m}
  moon: {x: 90 m, y: 0 m}
  here: {x: -1 m, y: 0 m}
"""
    for name, data in map_files(ONE_WALL, "one_wall").items():
        tmp_path.joinpath(name).write_bytes(data)
    tmp_path.joinpath("room.yaml").write_text(WORLD + things, encoding="utf-8")
    text = Project(tmp_path).check(ROBOT + places).text
    assert "cannot drive to 'wall': a wall is there" in text
    assert "cannot drive to 'sofa': 'sofa' is there" in text
    assert "cannot drive to 'moon': it is outside of the map" in text
    assert "'here'" not in text
    assert "no way leads" not in text


def test_what_cuts_a_place_off_from_the_start_or_from_another_place_is_found(tmp_path: Path) -> None:
    chest = "objects: {chest: {box: [40 cm, 6 m, 50 cm], at: {x: 50 cm, y: 0 m}}}\n"
    places = "places: {east: {x: 2 m, y: 0 m}, west: {x: -2 m, y: 1 m}}\n"
    for name, data in map_files(ONE_WALL, "one_wall").items():
        tmp_path.joinpath(name).write_bytes(data)
    tmp_path.joinpath("room.yaml").write_text(WORLD + chest, encoding="utf-8")
    text = Project(tmp_path).check(places + ROBOT).text
    assert "no way leads from where the robot starts to 'east': something is all around; it gets no nearer" in text
    assert "'west'" not in text
    zone = "  costs: {zones: {carpet: {keep_out: [[-3 m, -3 m], [WIDE m, -3 m], [WIDE m, 3 m], [-3 m, 3 m]]}}}\n"
    for wide in ("-1", "3"):  # around where it starts, and everywhere
        text = Project(tmp_path).check(places + ROBOT + zone.replace("WIDE", wide)).text
        for name in ("east", "west"):
            assert f"to '{name}': zones to keep out of leave no way out of there" in text
    localised = ROBOT + "  localisation: {type: particles, anywhere: true}\n"
    text = Project(tmp_path).check(places + localised).text
    assert "no way leads from 'east' to 'west': something is all around" in text
    one = places.replace("east: {x: 2 m, y: 0 m}, ", "")
    assert "no way leads" not in Project(tmp_path).check(one + localised).text


def test_navigation_by_the_map_alone_takes_no_scans(tmp_path: Path) -> None:
    room = Room(tmp_path, robot=ROBOT + "  costs: {map_only: true}\n")
    navigator: Any = room.bench.component("go_to")
    assert not navigator.config.scan


def test_a_laser_that_falls_silent_stops_the_robot_and_fails_the_goal(tmp_path: Path) -> None:
    room = Room(tmp_path, SCANNED)
    scan = LaserScan(Header(frame_id="base_link"), 0.0, 0.0, 0.1, 0.0, 0.1, 0.1, 9.0, np.array([math.inf], np.float32))

    def scans(count: int) -> None:
        for _ in range(count):
            room.bench.publish("/scan", scan)
            room.bench.advance(0.1)

    scans(1)
    room.bench.bus.action_client("me", "/go_to", NavigateToPose)(
        NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), Pose(Point(2.0, 0.3)))), room.ends.append
    )
    scans(30)
    assert room.base.core.velocity.linear > 0.3
    room.bench.advance(2.0)
    assert room.base.is_at_rest
    assert not room.ends
    assert room.bench.run_until(lambda: bool(room.ends), 20.0)
    assert room.reason() == "the laser on 'scan' is silent"


def test_a_base_stops_where_it_touches_and_may_leave_again(tmp_path: Path) -> None:
    room = Room(tmp_path, world=WORLD.replace("-2 m", "-1 m"))
    for speed, count in ((0.4, 40), (-0.3, 20)):
        for _ in range(count):
            room.bench.publish("/cmd_vel", Twist(linear=Vector3(x=speed)))
            room.bench.advance(0.1)
        if speed > 0:
            assert room.base.core.pose.x == pytest.approx(-0.1 - 0.175, abs=0.002)
            assert [contact.data for contact in room.contacts] == ["map"]
            assert room.base.core.distance == pytest.approx(1.0 - 0.275, abs=0.002)
    assert room.base.core.pose.x == pytest.approx(-0.275 - 0.55, abs=0.1)


@pytest.mark.parametrize("name", ["base_footprint", *rare("visitor")])
def test_who_walks_into_a_base_that_stands_touches_it_once_each_time(tmp_path: Path, name: str) -> None:
    path = "[[0 s, -2 m, 1 m], [2 s, -2 m, 0.3 m], [3 s, -2 m, 0.3 m], [4 s, -2 m, 1 m]]"
    walker = f"objects:\n  {name}: {{shape: person, path: {path}, repeats: true}}\n"
    room = Room(tmp_path, world=WORLD + walker)
    room.bench.advance(8.0)
    assert [contact.data for contact in room.contacts] == [name, name]
    assert room.bench.host.summary()["base"] == {"distance driven": "0.00 m", "contacts": "2"}


def test_a_laser_sees_what_stands_at_its_height(tmp_path: Path) -> None:
    low = "objects:\n  step: {box: [20 cm, 20 cm, 5 cm], at: {x: -1 m}}\n"
    room = Room(tmp_path, robot=ROBOT.replace(", noise: 5 mm", ""), world=WORLD + low)
    scans = room.bench.collect("/scan", LaserScan)
    room.bench.advance(0.3)
    ahead = scans[-1].ranges[len(scans[-1].ranges) // 2]
    assert ahead == pytest.approx(1.9, abs=1e-6)  # over the step, to the wall


TURNED = """<robot name="turned"><link name="base_footprint"/><link name="base_link"><collision><geometry>
<cylinder radius="0.17" length="0.18"/></geometry></collision></link><link name="laser_link"/>
<joint name="body" type="fixed"><parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.1"/></joint>
<joint name="mount" type="fixed"><parent link="base_link"/><child link="laser_link"/>
<origin xyz="0.1 0.05 0.2" rpy="ROLL 0.1 1"/></joint></robot>"""
BOX = "objects:\n  box: {box: [20 cm, 20 cm, 80 cm], at: {x: -1.5 m, y: 70 cm}}\n"


@pytest.mark.parametrize("roll", [math.pi, *rare(0.0, 3.0)])
def test_a_laser_may_be_mounted_upside_down(tmp_path: Path, roll: float) -> None:
    (tmp_path / "robots/one").mkdir(parents=True)
    (tmp_path / "robots/one/turned.urdf").write_text(TURNED.replace("ROLL", str(roll)), encoding="utf-8")
    robot = ROBOT.replace("rbx:robots/turtlebot/turtlebot.urdf", "turned.urdf").replace(
        "base_link, noise", "laser_link, noise"
    )
    room = Room(tmp_path, robot + "  costs: {obstacles: {frame: laser_link}}\n", WORLD + BOX)
    maps = room.bench.collect("/global_costmap/costmap", OccupancyGrid, Qos.LATCHED)
    scans = room.bench.collect("/scan", LaserScan)
    room.bench.advance(2.0)
    sensor = Transform3((-2.0, 0.0, 0.1)).compose(Transform3((0.1, 0.05, 0.2), quaternion_from_rpy(roll, 0.1, 1.0)))
    angles, ranges = rays_of(scans[-1])
    ends = [
        sensor.apply((reach * math.cos(angle), reach * math.sin(angle), 0.0))
        for angle, reach in zip(angles, ranges, strict=True)
        if reach < 0.9
    ]
    assert len(ends) >= 5
    assert all(-1.65 < x < -1.35 and 0.55 < y < 0.85 for x, y, _ in ends)
    costs = grid_of(maps[-1])
    assert costs.occupied_at((-1.5, 0.63))
    assert not costs.occupied_at((-1.5, -0.63))


@given(
    st.tuples(*[st.floats(-math.pi, math.pi)] * 3),
    st.floats(-math.pi, math.pi),
    st.lists(st.floats(0.1, 10.0), min_size=1, max_size=20),
)
def test_rays_end_where_the_transform_of_their_sensor_puts_them(
    rpy: tuple[float, float, float], first: float, reaches: list[float]
) -> None:
    at = Transform3((1.0, -2.0, 0.3), quaternion_from_rpy(*rpy))
    scan = LaserScan(angle_min=first, angle_increment=0.1, ranges=np.array(reaches, np.float32))
    pose, angles, ranges = level_rays(at, scan)
    for turned, share, angle, reach in zip(angles, ranges, *rays_of(scan), strict=True):
        x, y, _ = at.apply((reach * math.cos(angle), reach * math.sin(angle), 0.0))
        heading = pose.heading + turned
        assert (pose.x + share * math.cos(heading), pose.y + share * math.sin(heading)) == pytest.approx(
            (x, y), abs=1e-4
        )


PIT = "holes: {pit: {area: [[-3 m, -1 m], [1 m, -1 m], [1 m, 5 cm], [-3 m, 5 cm]]}}\n"


def test_a_spawn_without_ground_concerns_only_robots_that_start_there(tmp_path: Path) -> None:
    elsewhere = ROBOT.replace("../../room.yaml", "{file: ../../room.yaml, spawn: east}")
    room = Room(tmp_path, elsewhere, WORLD + "  east: {x: 2 m, y: 1 m}\n" + PIT)
    assert "RBX3611" not in room.checked.text


@for_all(
    "robot, world, said",
    [
        (ROBOT.replace("room.yaml", "rom.yaml"), WORLD, "rom.yaml"),
        (ROBOT, WORLD.replace("one_wall.yaml", "two_walls.yaml"), "two_walls.yaml"),
        (ROBOT, WORLD.replace("map: one_wall.yaml", "map: one_wall.pgm"), "RBX3600"),
        (ROBOT, WORLD.replace("kind: World", "kind: Wolrd"), "World"),
        (ROBOT, WORLD + "objects: {chair: {sphere: 1 m}}\n", "unknown key 'sphere'"),
        (ROBOT, WORLD + "objects: {chair: {at: {x: 1 m}}}\n", "an object has one shape"),
        (ROBOT, WORLD + "holes: {pit: {area: [[0 m, 0 m], [1 m, 0 m]]}}\n", "three corners"),
        (ROBOT, WORLD + PIT, "no ground: above the hole 'pit' of 'room'"),
        (ROBOT.replace("25 Hz", "25 Hz, wheel_distance: 23 cm"), WORLD.replace("y: 0 m", "y: 16 cm") + PIT, "'pit'"),
        (ROBOT, WORLD.partition("spawn")[0] + PIT, "above the hole 'pit'"),
        (ROBOT.replace("world: ../../room.yaml\n", ""), WORLD, "navigation needs a map"),
        (ROBOT.replace("../../room.yaml", "{file: ../../room.yaml, spawn: wset}"), WORLD, "did you mean 'west'?"),
        (ROBOT, WORLD.replace("-2 m", "-2.8 m"), "the robot starts 0.07 m deep in a wall of 'room'"),
        (ROBOT, WORLD.replace("-2 m", "50 m"), "the robot starts outside of the map of 'room': at (50 m, 0 m)"),
        (ROBOT, WORLD + "objects: {chair: {shape: person, at: {x: -1.9 m}}}\n", "deep in 'chair'"),
        (ROBOT + "  costs: {zones: {stairs: {keep_out: [[0 m, 0 m], [1 m, 0 m]]}}}\n", WORLD, "three corners"),
    ],
)
def test_what_is_wrong_is_said_before_a_motor_moves(tmp_path: Path, robot: str, world: str, said: str) -> None:
    for name, data in map_files(ONE_WALL, "one_wall").items():
        tmp_path.joinpath(name).write_bytes(data)
    tmp_path.joinpath("room.yaml").write_text(world, encoding="utf-8")
    checked = Project(tmp_path).check(robot)
    assert checked.compilation.plan is None
    assert said in checked.text


@pytest.mark.soak
def test_the_house_cleans_the_house_and_never_touches_a_wall(repository: Path) -> None:
    plan = compile_robot("robots/house", environment={}).plan
    assert plan
    ran = run_robot(plan)
    assert ran.outcome == "success"
    base = ran.bench.component("base_wheels")
    assert isinstance(base, DiffDriveSim)
    assert base.contacts == 0
    assert base.core.distance > 15


@pytest.mark.soak
def test_somebody_who_walks_in_the_way_is_not_run_into(tmp_path: Path) -> None:
    walker = """objects:
  visitor:
    shape: person
    path: [[0 s, -1 m, 2.3 m], [7 s, -1 m, -0.5 m], [14 s, -1 m, 2.3 m]]
    repeats: true
"""
    room = Room(tmp_path, world=WORLD + walker)
    approaches = []  # [m/s] when they touch: who walks on into a robot touches it all the same

    def touched(message: String) -> None:
        assert room.base.world is not None
        (walker,) = room.base.world.shapes
        at, person = room.base.core.pose, walker.at(room.bench.clock.now())
        bearing = math.atan2(person.pose.y - at.y, person.pose.x - at.x) - at.heading
        approaches.append(driven[-1].twist.twist.linear.x * math.cos(bearing))

    room.bench.bus.subscribe("me", "/contact", String, Qos.EVENT, touched)
    driven = room.bench.collect("/odom", Odometry)
    for goal in ((2.0, 0.3), (-2.0, 0.0), (2.0, -1.0)):
        assert room.go(*goal).outcome is Outcome.SUCCEEDED
    assert max(approaches, default=0.0) < 0.05


@pytest.mark.soak  # a robot of `test_mapping` drives by it, too
def test_the_simulator_tells_where_the_robot_is_however_wrong_its_odometry(tmp_path: Path) -> None:
    robot = ROBOT.replace("diff_drive_sim}", "diff_drive_sim, drift: 50 %}") + "  localisation: {type: fake}\n"
    room = Room(tmp_path, robot)
    told = room.bench.collect("/amcl_pose", PoseWithCovarianceStamped)
    for x, y in ((2.0, 0.3), (2.0, 2.0)):
        assert room.go(x, y).outcome is Outcome.SUCCEEDED
        assert room.base.core.pose.distance(Pose2(x, y)) < 0.12
    assert room.base.estimate.distance(room.base.core.pose) > 0.3
    assert room.contacts == []
    assert pose_in(told[-1].pose.pose).distance(room.base.core.pose) < 0.05


def test_a_robot_stops_soon_after_nobody_localises_it_any_more(tmp_path: Path) -> None:
    room = Room(tmp_path, ROBOT.replace(LASER, "") + "  localisation: {type: fake}\n")
    goal = NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), Pose(Point(-2.0, 2.5, 0.0))))
    room.bench.bus.action_client("me", "/go_to", NavigateToPose)(goal, room.ends.append, room.feedback.append)
    assert room.bench.run_until(lambda: room.base.core.velocity.linear > 0.3, 20.0)
    room.bench.host.retire(["localisation"])
    room.bench.advance(2.5)
    assert room.base.is_at_rest
    assert room.bench.run_until(lambda: bool(room.ends), 30.0)
    assert room.reason() == "it is not known where the robot is in 'map'"


def test_a_real_robot_has_no_simulator_that_tells_where_it_is(tmp_path: Path) -> None:
    Room(tmp_path, ROBOT + "  localisation: {type: fake}\n")
    report = compile_robot(str(tmp_path / "robots/one"), real=True, environment={}).report
    assert any(finding.code == "RBX3621" and "the robot is real" in finding.message for finding in report)


def test_a_manifest_says_how_many_particles_there_are(tmp_path: Path) -> None:
    counts = "  localisation: {type: particles, particles: {least: 50, most: 150}, anywhere: true}\n"
    room = Room(tmp_path, ROBOT + counts)
    room.bench.advance(1.0)
    localisation: Any = room.bench.component("localisation")
    assert 50 <= len(localisation.filter.poses) <= 150


def localised(tmp_path: Path) -> tuple[Room, list[PoseWithCovarianceStamped], list[DiagnosticStatus]]:
    """Return a robot that has driven on from its start, with what its localisation tells from then on."""
    robot = ROBOT.replace("diff_drive_sim}", "diff_drive_sim, drift: 1 %}")
    room = Room(tmp_path, robot + "  localisation: {type: particles}\n")
    assert room.go(-0.6, 1.5).outcome is Outcome.SUCCEEDED
    room.bench.advance(0.5)
    told = room.bench.collect("/amcl_pose", PoseWithCovarianceStamped)
    return room, told, room.bench.statuses("localisation: scan")


def is_at(room: Room, told: list[PoseWithCovarianceStamped]) -> bool:
    return bool(told) and all(pose_in(one.pose.pose).distance(room.base.core.pose) < 0.2 for one in told)


def test_before_the_first_scan_a_robot_is_at_its_start_by_odometry(tmp_path: Path) -> None:
    room = Room(tmp_path, SCANNED + "  localisation: {type: particles}\n")
    statuses = room.bench.statuses("localisation: scan")
    placed = room.bench.collect("/tf", TFMessage)
    room.bench.advance(2.0)
    corrections = [each for message in placed for each in message.transforms if each.child_frame_id == "odom"]
    assert {(each.transform.translation.x, each.transform.translation.y) for each in corrections} == {(0.0, 0.0)}
    assert {(status.level, status.message) for status in statuses} == {
        (Level.OK, "no scan has been compared with the map yet")
    }


def test_a_robot_that_believes_in_another_place_is_warned_of(tmp_path: Path) -> None:
    room = Room(tmp_path, ROBOT + "  localisation: {type: particles, start: {x: 2 m, y: 2 m, heading: 90 deg}}\n")
    statuses = room.bench.statuses("localisation: scan")
    turn = Twist(angular=Vector3(z=0.5))
    for _ in range(20):
        room.bench.publish("/cmd_vel", turn)
        room.bench.advance(0.2)
    assert statuses[-1].level == Level.WARN
    assert statuses[-1].message.endswith("either much is not on the map, or the robot is elsewhere on it")


def test_a_late_laser_does_not_make_odometry_begin_again(tmp_path: Path) -> None:
    robot = ROBOT.replace("noise:", "latency: 0.8 s, noise:").replace("0.4 m/s", "0.5 m/s")
    room = Room(tmp_path, robot + "  localisation: {type: particles}\n")
    statuses = room.bench.statuses("localisation: scan")
    assert room.go(-0.6, 1.5).outcome is Outcome.SUCCEEDED
    assert Level.ERROR not in {status.level for status in statuses}


def test_an_initial_pose_is_given_in_the_map(tmp_path: Path) -> None:
    room = Room(tmp_path, ROBOT + "  localisation: {type: particles}\n")
    told = room.bench.collect("/amcl_pose", PoseWithCovarianceStamped)
    pose = PoseWithCovariance(message_of(Pose2(2.0, 2.0)), np.zeros(36))
    room.bench.publish("/initialpose", PoseWithCovarianceStamped(Header(frame_id="odom"), pose), Qos.EVENT)
    room.bench.advance(1.0)
    assert room.bench.texts()[-1].endswith("an initial pose must be given in 'map', not in 'odom'")
    assert told == []
    room.bench.publish("/initialpose", PoseWithCovarianceStamped(Header(), pose), Qos.EVENT)
    room.bench.advance(1.0)
    assert told


@pytest.mark.parametrize("how", ["fails", "is replaced"])
def test_a_localisation_that_restarts_goes_on_where_the_robot_is(tmp_path: Path, how: str) -> None:
    room, told, statuses = localised(tmp_path)
    host = room.bench.host
    assert room.base.core.pose.distance(Pose2(-2.0, 0.0)) > 1.0
    if how == "fails":
        host.failed("localisation", ValueError("planted"))
    else:
        host.prepare([host.hosted["localisation"].instance])
        host.activate(["localisation"])
    room.bench.advance(3.0)
    assert is_at(room, told)
    assert statuses[-1].level == Level.OK
    assert room.go(-2.0, 1.0).outcome is Outcome.SUCCEEDED
    assert room.base.core.pose.distance(Pose2(-2.0, 1.0)) < 0.2


def test_a_localisation_that_cannot_know_its_place_after_a_restart_lets_nothing_drive(tmp_path: Path) -> None:
    room, told, statuses = localised(tmp_path)
    localisation: Any = room.bench.component("localisation")
    localisation.keep(None)
    before = room.base.core.pose
    room.bench.host.failed("localisation", ValueError("planted"))
    room.bench.advance(3.0)
    assert room.go(-2.0, 1.0).outcome is Outcome.ABORTED
    assert "no pose of 'base_link' in 'map'" in room.reason()
    assert (room.base.core.pose, told) == (before, [])
    assert statuses[-1].level == Level.ERROR
    assert "does not know where the robot is, so nothing drives: give a pose on 'initialpose'" in statuses[-1].message
    pose = PoseWithCovariance(message_of(before), np.zeros(36))
    room.bench.publish("/initialpose", PoseWithCovarianceStamped(Header(frame_id="map"), pose), Qos.EVENT)
    assert room.go(-2.0, 1.0).outcome is Outcome.SUCCEEDED
    assert is_at(room, told[-1:])


@pytest.mark.parametrize("stays", [True, False])
def test_a_robot_whose_odometry_begins_again_is_where_the_laser_sees_it(tmp_path: Path, *, stays: bool) -> None:
    room, told, statuses = localised(tmp_path)
    if stays:
        room.base.estimate = Pose2()
    else:
        room.bench.host.failed("base", ValueError("planted"))  # a simulated one is carried to its start
    room.bench.advance(3.0)
    assert is_at(room, told)
    assert statuses[-1].level == Level.OK
    assert room.go(-2.0, 1.0).outcome is Outcome.SUCCEEDED
    assert is_at(room, told[-1:])


@pytest.mark.soak
def test_a_laser_finds_the_robot_where_its_odometry_errs(tmp_path: Path) -> None:
    robot = ROBOT.replace("diff_drive_sim}", "diff_drive_sim, drift: 16 %}")
    lost, found = (Room(tmp_path, f"{robot}{more}") for more in ("", "  localisation: {type: particles}\n"))
    errors, told = {}, found.bench.collect("/amcl_pose", PoseWithCovarianceStamped)
    for room in (lost, found):
        for x, y in ((2.0, 0.3), (-2.0, 1.0)):
            room.go(x, y)
        errors[room] = room.base.core.pose.distance(Pose2(-2.0, 1.0))
    assert errors[lost] > 0.4
    assert errors[found] < 0.2
    assert found.contacts == []
    assert pose_in(told[-1].pose.pose).distance(found.base.core.pose) < 0.15


def test_a_robot_keeps_out_of_holes_and_a_place_in_one_is_cut_off(tmp_path: Path) -> None:
    hole = "holes:\n  stairs: {area: [[-1.6 m, -60 cm], [-80 cm, -60 cm], [-80 cm, 60 cm], [-1.6 m, 60 cm]]}\n"
    places = "places:\n  down: {x: -1.2 m, y: 0 m}\n  beyond: {x: -50 cm, y: 0 m}\n"
    room = Room(tmp_path, f"{ROBOT}{places}", WORLD + hole)
    assert "'down'" in "".join(line for line in room.checked.text.splitlines() if "RBX3610" in line)
    assert room.checked.codes.count("RBX3610") == 1
    driven = room.bench.collect("/ground_truth", Odometry)
    assert room.go(-0.5, 0.0).outcome is Outcome.SUCCEEDED
    places_on_way = [message.pose.pose.position for message in driven]
    assert not any(-1.6 < at.x < -0.8 and abs(at.y) < 0.6 for at in places_on_way)
