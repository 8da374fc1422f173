"""Ways through a map."""

from __future__ import annotations

import math
from contextlib import suppress
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation import planner
from rbxcompose.domains.navigation.costs import INSCRIBED, CostSettings, CostZone, LayeredCosts
from rbxcompose.domains.navigation.planner import NoPathError, plan
from tests.navigation.houses import HOUSE, ONE_WALL, SIDE, is_blocked, length_of, room

SETTINGS = CostSettings(radius=0.2, inflation=0.5)
COSTS = LayeredCosts(HOUSE, SETTINGS)
PLACES = st.builds(Pose2, st.floats(-3.2, 3.2), st.floats(-3.2, 3.2), st.floats(-math.pi, math.pi))


def test_a_way_leads_around_a_wall_and_ends_as_the_goal_does() -> None:
    goal = Pose2(2.0, 0.3, 1.0)
    found = plan(LayeredCosts(ONE_WALL, SETTINGS), Pose2(-2.0, 0.0), goal, 0.1)
    assert found.poses[-1].distance(goal) < 1e-9
    assert found.poses[-1].heading == goal.heading
    assert (found.poses[0].x, found.poses[0].y) == (-2.0, 0.0)
    assert max(abs(pose.y) for pose in found.poses) > 1.8
    shortest = math.dist((-2, 0), (0, 1.8)) + math.dist((0, 1.8), (2, 0.3))
    assert shortest < length_of(found) < 1.15 * shortest


def test_in_the_open_it_is_straight() -> None:
    found = plan(LayeredCosts(room(), SETTINGS), Pose2(-2.0, -1.0), Pose2(2.0, 1.3), 0.1)
    assert length_of(found) == pytest.approx(math.hypot(4.0, 2.3), abs=0.02)


@given(PLACES, PLACES)
@settings(max_examples=3 * settings().max_examples)
def test_no_pose_of_a_way_is_blocked_and_poses_are_close(start: Pose2, goal: Pose2) -> None:
    assume(not is_blocked(COSTS, start.x, start.y) and not is_blocked(COSTS, goal.x, goal.y))
    found = plan(COSTS, start, goal, 0.1)
    assert not any(is_blocked(COSTS, pose.x, pose.y) for pose in found.poses)
    assert all(before.distance(after) < 2 * SIDE for before, after in pairwise(found.poses))


def test_a_goal_that_cannot_be_reached_says_why_and_how_near() -> None:
    costs = LayeredCosts(room((1.0, -3, 1.2, 3)), SETTINGS)
    with pytest.raises(NoPathError, match="no way leads to the goal") as trouble:
        plan(costs, Pose2(), Pose2(2.0, 0.0), 0.1)
    assert trouble.value.nearest == pytest.approx(1.3, abs=0.1)
    with pytest.raises(NoPathError, match="an obstacle is at the goal"):
        plan(costs, Pose2(), Pose2(1.1, 0.0), 0.1)
    zone = CostZone("carpet", ((-2.0, -1.0), (-1.0, -1.0), (-1.0, 1.0), (-2.0, 1.0)))
    with pytest.raises(NoPathError, match="the zone 'carpet' keeps the robot from the goal"):
        plan(LayeredCosts(costs.grid, SETTINGS, [zone]), Pose2(), Pose2(-1.5, 0.0), 0.1)
    with pytest.raises(NoPathError, match="outside of the map") as outside:
        plan(costs, Pose2(), Pose2(9.0, 0.0), 0.1)
    assert outside.value.is_final


def test_a_goal_in_an_obstacle_is_reached_within_the_tolerance() -> None:
    found = plan(LayeredCosts(ONE_WALL, SETTINGS), Pose2(-2.0, 0.0), Pose2(-0.2, 0.0), 0.3)
    assert 0 < found.poses[-1].distance(Pose2(-0.2, 0.0)) <= 0.3


def test_a_robot_that_touches_something_may_leave_it() -> None:
    assert length_of(plan(LayeredCosts(ONE_WALL, SETTINGS), Pose2(-0.2, 0.0), Pose2(-2.0, 0.0), 0.1)) > 1.7


@given(PLACES, PLACES)
@settings(max_examples=3 * settings().max_examples)
def test_on_its_way_out_it_touches_nothing_more_than_at_first(start: Pose2, goal: Pose2) -> None:
    costs = LayeredCosts(HOUSE, CostSettings(radius=0.9, inflation=1.0))
    assume(is_blocked(costs, start.x, start.y) and not costs.is_wall(start.x, start.y))
    with suppress(NoPathError):
        for pose in plan(costs, start, goal, 0.1).poses:
            cell = costs.cell_of(pose.x, pose.y)
            at_first = costs.away[costs.cell_of(start.x, start.y)]
            assert costs.values[cell] < INSCRIBED or costs.away[cell] >= at_first - SIDE


@pytest.mark.parametrize("radius", [6.0, 1e9])
def test_a_robot_that_fits_nowhere_finds_no_way_for_ever(radius: float) -> None:
    with pytest.raises(NoPathError, match="the robot fits nowhere on the map: it covers a circle with") as trouble:
        plan(LayeredCosts(room(), CostSettings(radius, inflation=radius)), Pose2(), Pose2(1.0, 0.0), 0.1)
    assert trouble.value.is_final


def test_a_large_map_is_searched_roughly_first_with_the_same_result(monkeypatch: pytest.MonkeyPatch) -> None:
    start, goal = Pose2(-3.0, -3.0), Pose2(3.0, 3.0)
    exact = plan(COSTS, start, goal, 0.1)
    monkeypatch.setattr(planner, "LARGE", 1)
    assert length_of(plan(COSTS, start, goal, 0.1)) < 1.05 * length_of(exact)
