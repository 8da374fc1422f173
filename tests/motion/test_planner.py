"""Planned motions: free and within all limits by other code, the same for the same seed, or a reason."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.domains.arms.motion.collisions import TOUCH
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionRequest
from rbxcompose.domains.arms.motion.search import searched
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.arms.section_models import OMPL
from rbxcompose.domains.servos.curves import cubic
from tests.body.kinematics import description_of
from tests.motion.toy_arm import FENCE, Array, ended, gap, planner, urdf
from tests.soak import rare

PLANNER = planner()
BODY = description_of(urdf()).body
LEFT, RIGHT = np.array([0.8, 0.0, 0.2]), np.array([-0.8, 0.0, 0.2])


def plan(start: Array, goal: Array, speed: float = 1.0, **changed: object) -> MotionPlan | MotionFailure:
    used = planner(**changed) if changed else PLANNER  # type: ignore[arg-type]
    return ended(used.plan(MotionRequest(start, goal, speed)))


def sampled(trajectory: Trajectory, step: float) -> list[Array]:
    """Return positions at most `step` apart on the curves that the controller makes of a trajectory."""
    columns = zip(trajectory.positions.T.tolist(), trajectory.velocities.T.tolist(), strict=True)
    curves = [cubic(trajectory.times.tolist(), *column) for column in columns]
    count = math.ceil(trajectory.duration * max(curve.speed for curve in curves) / step)
    times = np.linspace(0.0, trajectory.duration, count + 1).tolist()
    return [np.array([curve.sample(time).position for curve in curves]) for time in times]


@settings(max_examples=settings().max_examples // 2)
@given(st.integers(0, 2**31))
def test_a_plan_is_free_and_within_all_limits_by_other_code(seed: int) -> None:
    samples = PLANNER.space.samples(60, seed)
    start, goal = [sample for sample in samples if gap(BODY, sample) > 0.01][:2]
    found = plan(start, goal)
    assert isinstance(found, MotionPlan), found
    assert found.trajectory is not None
    points = sampled(found.trajectory, 0.005)
    assert np.allclose(points[0], start)
    assert np.allclose(points[-1], goal)
    assert min(gap(BODY, point) for point in points) >= -TOUCH
    assert all(not PLANNER.space.outside(point, 1e-6) for point in points)
    assert found.trajectory.excess(np.full(3, 2.0), np.full(3, 4.0)) <= 1.0 + 1e-9


def test_the_same_seed_gives_the_same_way_and_another_one_another() -> None:
    plans = [plan(LEFT, RIGHT, seed=seed) for seed in (3, 3, 4)]
    ways = [one.trajectory.positions.tobytes() for one in plans if isinstance(one, MotionPlan) and one.trajectory]
    assert len(ways) == 3
    assert ways[0] == ways[1] != ways[2]


def test_half_the_speed_takes_longer_and_keeps_the_lower_limit() -> None:
    found = plan(LEFT, LEFT + 0.5, 0.5)
    assert isinstance(found, MotionPlan)
    assert found.trajectory is not None
    assert found.trajectory.excess(np.full(3, 1.0), np.full(3, 4.0)) <= 1.0 + 1e-9


def test_an_arm_that_is_where_it_should_be_does_not_move() -> None:
    found = plan(LEFT, LEFT)
    assert isinstance(found, MotionPlan)
    assert found.trajectory is None


IN_WALL = np.array([0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("start", "goal", "reason", "named"),
    [
        (LEFT, np.array([math.nan, 0.0, 0.0]), MotionReason.GOAL_OUTSIDE_LIMITS, "'turn' at nan"),
        (LEFT, np.array([math.inf, 0.0, 0.0]), MotionReason.GOAL_OUTSIDE_LIMITS, "'turn' at inf"),
        (np.array([math.nan, 0.0, 0.0]), LEFT, MotionReason.START_OUTSIDE_LIMITS, "'turn' at nan"),
        (LEFT, np.array([0.8, 3.0, 0.0]), MotionReason.GOAL_OUTSIDE_LIMITS, "'lift' at 171.9 deg is beyond"),
        (IN_WALL, LEFT, MotionReason.START_IN_COLLISION, "'fore' and 'ground'"),
        (LEFT, IN_WALL, MotionReason.GOAL_IN_COLLISION, "'fore' and 'ground'"),
    ],
)
def test_what_cannot_be_has_a_reason_that_names_it(start: Array, goal: Array, reason: MotionReason, named: str) -> None:
    found = plan(start, goal)
    assert isinstance(found, MotionFailure)
    assert found.reason is reason
    assert named in found.text


def test_a_goal_behind_a_fence_is_given_up_in_time() -> None:
    used = planner(FENCE, time=0.2)
    found = ended(used.plan(MotionRequest(LEFT, RIGHT)))
    assert isinstance(found, MotionFailure)
    assert found.reason is MotionReason.NO_PATH_IN_TIME
    assert "rrt_connect found none in 0.2 s" in found.text


@pytest.mark.parametrize("name", ["rrt_connect", *rare(*(name for name in OMPL if name != "rrt_connect"))])
def test_a_search_that_is_given_up_leaves_nothing_behind_that_could_crash(name: str) -> None:
    used = planner(FENCE)
    for seed in range(3):
        search = searched(used.space, LEFT, RIGHT, used.checker.is_free, planner=name, seed=seed, resolution=0.05)
        next(search)
        search.close()


def test_a_start_that_servos_measure_just_outside_of_its_limits_is_none() -> None:
    assert isinstance(plan(np.array([0.8, 1.51, 0.2]), LEFT), MotionPlan)
    far = plan(np.array([0.8, 1.6, 0.2]), LEFT)
    assert isinstance(far, MotionFailure)
    assert far.reason is MotionReason.START_OUTSIDE_LIMITS


@pytest.mark.parametrize("name", ["aorrtc", *rare("rrt_star", "informed_rrt_star")])
def test_a_planner_that_improves_its_path_finds_one(name: str) -> None:
    found = plan(LEFT, RIGHT, planner=name, time=2.0)
    assert isinstance(found, MotionPlan), found
    again = plan(LEFT, RIGHT, planner=name, time=2.0)
    assert isinstance(again, MotionPlan)
    assert again.waypoints.tobytes() == found.waypoints.tobytes()


def test_a_path_that_is_not_simplified_is_longer() -> None:
    lengths = []
    for simplify in (True, False):
        found = plan(LEFT, RIGHT, simplify=simplify, planner="rrt")
        assert isinstance(found, MotionPlan)
        lengths.append(float(np.linalg.norm(np.diff(found.waypoints, axis=0), axis=1).sum()))
    assert lengths[0] < lengths[1]
