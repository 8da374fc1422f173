"""Robots that are no circles: their ways, how they drive on them, and what checks say."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.costs import CostSettings, LayeredCosts
from rbxcompose.domains.navigation.follower import FollowState
from rbxcompose.domains.navigation.manoeuvres import Manoeuvre, ManoeuvreState, SpinManoeuvre
from rbxcompose.domains.navigation.planner import NoPathError, PlannedPath, plan
from rbxcompose.domains.worlds.contact import first_contact, overlap
from rbxcompose.domains.worlds.grid_map import GridMap, map_files
from rbxcompose.domains.worlds.shapes import PolygonFootprint
from rbxcompose.msgs.nav2_msgs import Spin
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.sdk.bound import Outcome
from rbxcompose.sdk.ports import Qos
from tests.navigation.houses import HOUSE, ONE_WALL, SIDE, length_of, room
from tests.navigation.test_follower import Drive
from tests.navigation.test_robot import ROBOT, WORLD, Room
from tests.parts.project import Project

LONG = PolygonFootprint(((0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2), (0.4, -0.2)))  # 80 cm x 40 cm
CORNERS = "[[40 cm, 20 cm], [-40 cm, 20 cm], [-40 cm, -20 cm], [40 cm, -20 cm]]"
GAP = room((-0.1, -3, 0.1, -0.3), (-0.1, 0.3, 0.1, 3))  # 60 cm wide
ROOM = 0.08  # [m] along a way on which it is sure to stay: 2 cm off at a corner turn a step of one cell by 20 degrees
PLACES = st.builds(Pose2, st.floats(-2.8, 2.8), st.floats(-2.8, 2.8), st.floats(-math.pi, math.pi))


def costs_of(grid: GridMap) -> LayeredCosts:
    return LayeredCosts(grid, CostSettings(LONG.inner, 0.6, outline=LONG))


THROUGH_GAP, THROUGH_HOUSE = costs_of(GAP), costs_of(HOUSE)


def touches(grid: GridMap, poses: list[Pose2]) -> bool:
    return any(first_contact(grid, (), LONG, *motion) for motion in pairwise(poses))


@given(PLACES, PLACES, st.sampled_from([THROUGH_GAP, THROUGH_HOUSE]))
@settings(max_examples=settings().max_examples // 2, suppress_health_check=[HealthCheck.filter_too_much])
def test_a_long_robot_reaches_goals_and_no_corner_of_it_touches_anything(
    start: Pose2, goal: Pose2, costs: LayeredCosts
) -> None:
    assume(costs.room_at(np.array([(start.x, start.y)])) > LONG.reach + SIDE and costs.clear_at(goal) > 2 * SIDE)
    try:
        drive = Drive(costs, start, goal)
    except NoPathError:  # the goal is along a wall, and there is no room to turn to it
        assert costs.room_at(np.array([(goal.x, goal.y)])) < LONG.reach
        return
    state = drive.until_over()
    assert not touches(costs.grid, drive.poses)
    if costs.clearance(np.array([(pose.x, pose.y, pose.heading) for pose in drive.way.poses])) < ROOM:
        return
    assert state is FollowState.REACHED
    assert drive.pose.distance(goal) <= 0.1
    assert drive.driven <= 1.15 * length_of(drive.way) + 0.15


def test_a_long_robot_passes_a_gap_that_is_as_wide_as_it_straight() -> None:
    drive = Drive(THROUGH_GAP, Pose2(-2.0, 1.0), Pose2(2.0, -0.5))
    assert drive.until_over() is FollowState.REACHED
    within = [pose.heading for pose in drive.poses if abs(pose.x) < 0.3]
    assert max(map(abs, within)) < math.radians(15)
    as_a_circle = LayeredCosts(GAP, CostSettings(LONG.reach, 0.6))
    with pytest.raises(NoPathError, match="no way leads"):
        plan(as_a_circle, Pose2(-2.0, 1.0), Pose2(2.0, -0.5), 0.1)


def test_a_goal_at_which_the_robot_only_fits_along_a_wall_takes_its_heading_into_account() -> None:
    goal = Pose2(-2.5, 0.0, math.pi / 2)
    end = plan(THROUGH_GAP, Pose2(-1.5, -2.0), goal, 0.05).poses[-1]
    assert (end.distance(goal) <= 0.05, end.heading) == (True, goal.heading)
    with pytest.raises(NoPathError, match="with its heading, the robot does not fit at the goal"):
        plan(THROUGH_GAP, Pose2(-1.5, -2.0), Pose2(-2.55, goal.y, 0.0), 0.05)


@given(PLACES)
@settings(max_examples=8 * settings().max_examples)
def test_the_clearance_of_a_pose_is_positive_only_if_nothing_touches_the_robot(pose: Pose2) -> None:
    clearance, (depth, _) = THROUGH_HOUSE.clear_at(pose), overlap(HOUSE, [], LONG, pose)
    assert depth == 0 or clearance < 0.005
    assert depth > 0 or clearance > -0.6 * SIDE


def moved(manoeuvre: Manoeuvre, pose: Pose2, costs: LayeredCosts) -> tuple[Pose2, ManoeuvreState]:
    state = ManoeuvreState.MOVES
    while state is ManoeuvreState.MOVES:
        velocity, state = manoeuvre.update(pose, costs, 0.05)
        there = pose.moved(velocity, 0.05)
        assert first_contact(costs.grid, (), LONG, pose, there) is None
        pose = there
    return pose, state


def test_a_long_robot_does_not_turn_where_a_corner_of_it_would_touch_a_wall() -> None:
    beside = Pose2(-2.6, 0.0, math.pi / 2)  # 10 cm from a wall
    pose, state = moved(SpinManoeuvre(math.pi, 1.0, 1.5), beside, THROUGH_GAP)
    assert state is ManoeuvreState.BLOCKED
    assert pose.heading < math.radians(120)
    assert moved(SpinManoeuvre(math.pi, 1.0, 1.5), Pose2(-1.5, 0.0), THROUGH_GAP)[1] is ManoeuvreState.DONE


def test_a_way_is_blocked_where_the_robot_would_come_to_a_turn_with_a_corner_in_something() -> None:
    turn = Pose2(2.5, 0.0, math.pi / 2)  # beside a wall
    way = PlannedPath((Pose2(2.0, 0.0), turn, Pose2(2.5, 0.5, math.pi / 2)))
    assert THROUGH_GAP.clear_at(*way.poses) > 0
    assert way.is_blocked(Pose2(2.0, 0.0), THROUGH_GAP)
    assert not way.is_blocked(turn, THROUGH_GAP)


@pytest.mark.soak
def test_a_robot_with_corners_drives_through_the_gap_in_its_world(tmp_path: Path) -> None:
    robot = f"{ROBOT}  footprint: {CORNERS}\n"
    for name, data in map_files(GAP, "gap").items():
        tmp_path.joinpath(name).write_bytes(data)
    gap = Room(tmp_path, robot, WORLD.replace("one_wall.yaml", "gap.yaml"))
    poses: list[Pose2] = []
    gap.bench.bus.subscribe("me", "/odom", Odometry, Qos.STATE, lambda _: poses.append(gap.base.core.pose))
    assert gap.go(2.5, 0.3, math.pi / 2).outcome is Outcome.SUCCEEDED
    gap.ends.clear()
    gap.bench.advance(0.2)
    gap.bench.bus.action_client("me", "/spin", Spin)(Spin.Goal(target_yaw=math.pi), gap.ends.append)
    assert gap.bench.run_until(lambda: bool(gap.ends), 30.0)
    assert gap.ends[0].outcome is Outcome.ABORTED
    assert not touches(GAP, poses)


@pytest.mark.parametrize(
    ("footprint", "said"),
    [
        (CORNERS, ""),
        ("body", ""),
        ("[[10 cm, 20 cm], [-40 cm, 20 cm], [-40 cm, -20 cm], [10 cm, -20 cm]]", "its body extends 0.07 m beyond"),
        ("[[40 cm, 20 cm], [-40 cm, 20 cm]]", "a convex polygon"),
        ("[[40 cm, 20 cm], [10 cm, 20 cm], [10 cm, -20 cm]]", "around the origin"),
        ("bdy", "must be 'body'"),
    ],
)
def test_footprints_that_do_not_suit_are_found(tmp_path: Path, footprint: str, said: str) -> None:
    for name, data in map_files(ONE_WALL, "one_wall").items():
        tmp_path.joinpath(name).write_bytes(data)
    tmp_path.joinpath("room.yaml").write_text(WORLD, encoding="utf-8")
    text = Project(tmp_path).check(f"{ROBOT}  footprint: {footprint}\n").text
    assert said in text if said else not text


def test_a_place_is_checked_with_the_heading_that_a_long_robot_has_there(tmp_path: Path) -> None:
    for name, data in map_files(ONE_WALL, "one_wall").items():
        tmp_path.joinpath(name).write_bytes(data)
    tmp_path.joinpath("room.yaml").write_text(WORLD, encoding="utf-8")
    places = "places: {along: {x: -2.6 m, y: 0 m, heading: 90 deg}, into: {x: -2.6 m, y: 1 m}}\n"
    text = Project(tmp_path).check(f"{places}{ROBOT}  footprint: {CORNERS}\n").text
    assert "cannot drive to 'into': a wall is there" in text
    assert "'along'" not in text


def test_the_footprint_of_a_body_is_the_hull_of_its_collision_shapes(tmp_path: Path) -> None:
    crate = """<robot name="crate"><link name="base_footprint">
  <collision><origin xyz="0.1 0 0.1"/><geometry><box size="0.8 0.4 0.2"/></geometry></collision>
  <collision><origin xyz="0.1 0 0.2"/><geometry><cylinder radius="0.1" length="0.3"/></geometry></collision>
</link></robot>"""
    (tmp_path / "robots/one").mkdir(parents=True)
    (tmp_path / "robots/one/crate.urdf").write_text(crate, encoding="utf-8")
    for name, data in map_files(ONE_WALL, "one_wall").items():
        tmp_path.joinpath(name).write_bytes(data)
    tmp_path.joinpath("room.yaml").write_text(WORLD, encoding="utf-8")
    robot = ROBOT.replace("rbx:robots/turtlebot/turtlebot.urdf", "crate.urdf").replace("base_link", "base_footprint")
    plan_ = Project(tmp_path).check(f"{robot}  footprint: body\n").compilation.plan
    assert plan_
    [config] = [made.config for made in plan_.instances if made.name == "go_to"]
    hull: Any = config
    assert {(round(x, 6), round(y, 6)) for x, y in hull.corners} == {(0.5, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.5, -0.2)}
    assert hull.radius == pytest.approx(0.2)
