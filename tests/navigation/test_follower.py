"""Following a way, with a base that has limits."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, Velocity2
from rbxcompose.domains.navigation.costs import CostSettings, CostZone, LayeredCosts
from rbxcompose.domains.navigation.follower import FollowerSettings, FollowState, PathFollower
from rbxcompose.domains.navigation.planner import PlannedPath, plan
from rbxcompose.domains.worlds.contact import first_contact
from rbxcompose.domains.worlds.ray_casting import Rays
from rbxcompose.domains.worlds.shapes import CircleFootprint, WorldCylinder, WorldShape
from tests.navigation.houses import HOUSE, ONE_WALL, is_blocked, length_of, room

RADIUS = 0.18
COSTS = LayeredCosts(HOUSE, CostSettings(radius=RADIUS, inflation=0.5))
PLACES = st.builds(Pose2, st.floats(-3.2, 3.2), st.floats(-3.2, 3.2), st.floats(-math.pi, math.pi))
PERIOD = 0.05  # [s]


class Drive:
    """A robot that follows a way until something ends that."""

    def __init__(self, costs: LayeredCosts, start: Pose2, goal: Pose2, limits: FollowerSettings | None = None) -> None:
        self.costs, self.pose, self.goal = costs, start, goal
        self.follower = PathFollower(limits or FollowerSettings())
        self.way = self.find_way()
        self.driven = self.time = 0.0
        self.velocities = [Velocity2()]
        self.poses = [start]

    def find_way(self) -> PlannedPath:
        """Plan from where the robot is, and follow that."""
        way = plan(self.costs, self.pose, self.goal, 0.1)
        self.follower.start(way)
        return way

    def until_over(self, most: float = 120.0) -> FollowState:
        """Drive, and return how it ends; the base does what it is told."""
        state = FollowState.FOLLOWS
        over = (FollowState.REACHED, FollowState.BLOCKED, FollowState.STUCK)
        while state not in over and self.time < most:
            velocity, state = self.follower.update(self.pose, self.costs, PERIOD)
            self.velocities.append(velocity)
            self.pose = self.pose.moved(velocity, PERIOD)
            self.poses.append(self.pose)
            self.driven += abs(velocity.linear) * PERIOD
            self.time += PERIOD
        return state


@given(PLACES, PLACES)
def test_every_goal_is_reached_without_a_contact_and_hardly_farther_than_necessary(start: Pose2, goal: Pose2) -> None:
    assume(not is_blocked(COSTS, start.x, start.y) and not is_blocked(COSTS, goal.x, goal.y))
    drive = Drive(COSTS, start, goal)
    assert drive.until_over() is FollowState.REACHED
    assert drive.pose.distance(goal) <= 0.1
    assert abs(math.remainder(drive.pose.heading - goal.heading, math.tau)) <= math.radians(5)
    assert not any(first_contact(HOUSE, [], CircleFootprint(RADIUS), *motion) for motion in pairwise(drive.poses))
    assert drive.driven <= 1.15 * length_of(drive.way) + 0.15


def test_velocities_keep_their_limits() -> None:
    limits = FollowerSettings(speed=0.35, turn_rate=1.0, acceleration=0.4)
    drive = Drive(LayeredCosts(ONE_WALL, CostSettings(RADIUS)), Pose2(-2.0, 0.0, 2.0), Pose2(2.0, 0.3, 1.0), limits)
    assert drive.until_over() is FollowState.REACHED
    assert max(velocity.linear for velocity in drive.velocities) == pytest.approx(0.35)
    assert max(abs(velocity.angular) for velocity in drive.velocities) <= 1.0 + 1e-9
    speeds = [velocity.linear for velocity in drive.velocities]
    assert max(after - before for before, after in pairwise(speeds)) <= 0.4 * PERIOD + 1e-9


def test_it_is_slow_in_a_zone() -> None:
    area = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    costs = LayeredCosts(room(), CostSettings(RADIUS), [CostZone("hall", area, 0.5)])
    drive = Drive(costs, Pose2(-2.0, 0.0), Pose2(2.0, 0.0))
    assert drive.until_over() is FollowState.REACHED
    known = zip(drive.poses, drive.velocities, strict=True)
    assert max(velocity.linear for pose, velocity in known if abs(pose.x) < 1.0) == pytest.approx(0.2, abs=0.01)
    assert max(velocity.linear for velocity in drive.velocities) == pytest.approx(0.4)


def test_something_new_on_the_arc_stops_it_before_it_touches() -> None:
    costs = LayeredCosts(room(), CostSettings(RADIUS))
    drive = Drive(costs, Pose2(-2.0, 0.0), Pose2(2.0, 0.0))
    drive.until_over(3.0)
    costs.see(Pose2(-2.0, 0.0), [0.0], [2.0], 3.0)  # something at the origin
    assert drive.until_over() is FollowState.BLOCKED
    assert drive.pose.x < -RADIUS - 0.05


def test_without_a_way_there_is_nothing_to_follow() -> None:
    with pytest.raises(RuntimeError, match="before start"):
        PathFollower(FollowerSettings()).update(Pose2(), COSTS, PERIOD)


@given(st.floats(0.3, 0.9), st.floats(-math.pi / 2, math.pi / 2), st.floats(0.0, 2.0))
@settings(max_examples=settings().max_examples // 2)
def test_a_robot_stands_when_somebody_who_walks_in_front_of_it_is_there(speed: float, side: float, late: float) -> None:
    grid = room()
    costs, rays = LayeredCosts(grid, CostSettings(radius=RADIUS)), Rays(grid)
    drive = Drive(costs, Pose2(-2.3, 0.0), Pose2(2.3, 0.0))
    came, meets = Pose2(0.0, 0.0, side), late - 0.5
    for tick in range(160):
        now = tick * PERIOD
        at = came.compose(Pose2(speed * (5.0 - now) + meets, 0.0))
        person = WorldShape("person", WorldCylinder(0.25, 1.7), at)
        if tick % 2 == 0:
            angles = np.linspace(-math.pi, math.pi, 360, endpoint=False)
            ranges = rays.cast((drive.pose.x, drive.pose.y), angles + drive.pose.heading, 8.0, [person])
            costs.see(drive.pose, angles, ranges, 4.0, now)
        if drive.pose.distance(at) < RADIUS + 0.25:
            assert drive.velocities[-1].linear * math.cos(drive.pose.bearing(at)) < 0.05
            return
        velocity, _ = drive.follower.update(drive.pose, costs, PERIOD)
        drive.velocities.append(velocity)
        drive.pose = drive.pose.moved(velocity, PERIOD)
