"""The curves of a trajectory, and the positions at which they are examined."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from rbxcompose.domains.arms.goals import follow_goal
from rbxcompose.domains.arms.motion.parametrisation import MARGIN, Spline, Trajectory, curve, timed
from rbxcompose.domains.servos.controllers.joint_trajectory import trajectory_of
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.trajectory import (
    JointRules,
    TrajectoryPlan,
    TrajectoryPolicy,
    TrajectoryTolerance,
    plan_trajectory,
)

SEEDS = st.integers(0, 2**31)


@given(SEEDS, st.integers(2, 9), st.floats(1e-3, 0.3))
def test_positions_on_curves_are_as_near_to_each_other_as_asked_for(seed: int, count: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.01, 2.0, count))
    made = Trajectory(times, rng.normal(size=(count, 3)), rng.normal(scale=rng.uniform(0.0, 3.0), size=(count, 3)))
    found = made.dense(step)
    assert np.max(np.abs(np.diff(found, axis=0))) <= step * (1.0 + 1e-9)
    assert np.array_equal(found[0], made.positions[0])
    assert np.allclose(found[-1], made.positions[-1])


def test_a_straight_motion_is_examined_at_no_more_positions_than_needed() -> None:
    made = Trajectory(np.array((0.0, 2.0)), np.array(((0.0,), (1.0,))), np.array(((0.5,), (0.5,))))
    assert len(made.dense(0.01)) == 101


@given(SEEDS, st.integers(2, 7))
def test_a_trajectory_stays_on_the_curve_that_was_looked_at_before(seed: int, count: int) -> None:
    way = np.random.default_rng(seed).uniform(-2.0, 2.0, (count, 3))
    made, path = timed(way, np.full(3, 1.0), np.full(3, 4.0)), curve(way, 0.001)
    assert isinstance(made, Trajectory), made
    away = [np.min(np.linalg.norm(path - position, axis=1)) for position in made.positions]
    assert max(away) <= 0.005


@given(SEEDS, st.floats(0.01, 2.0))
def test_a_straight_line_is_at_least_as_fast_as_the_same_way_through_its_middle(seed: int, length: float) -> None:
    rng = np.random.default_rng(seed)
    way, fast, hard = rng.uniform(-length, length, (2, 3)), rng.uniform(0.3, 2.0, 3), rng.uniform(0.5, 5.0, 3)
    made, through = (timed(points, fast, hard) for points in (way, np.stack((way[0], way.mean(axis=0), way[1]))))
    assert isinstance(made, Trajectory)
    assert isinstance(through, Trajectory)
    assert made.excess(fast, hard) <= 1.0
    assert made.duration <= through.duration * (1.0 + 1e-6)


@given(st.floats(0.0, 1.0), st.integers(1, 16))
def test_a_line_that_is_hardly_ever_at_its_speed_has_samples_apart_in_time(share: float, places: int) -> None:
    made = timed(np.array(((0.0,), (MARGIN * (1.0 + share * 10.0**-places),))), np.ones(1), np.ones(1))
    assert isinstance(made, Trajectory)
    assert np.min(np.diff(made.times)) > 1e-9
    assert made.excess(np.ones(1), np.ones(1)) <= 1.0


@given(SEEDS, st.integers(2, 30))
def test_the_curve_is_the_natural_spline_of_scipy(seed: int, count: int) -> None:
    from scipy.interpolate import CubicSpline

    way = np.random.default_rng(seed).uniform(-2.0, 2.0, (count, 3))
    made = Spline(way)
    known, at = (
        CubicSpline(made.knots, way, bc_type="natural"),
        np.linspace(float(made.knots[0]), float(made.knots[-1]), 50),
    )
    for order, tolerance in enumerate((1e-11, 1e-9, 1e-7)):
        assert np.allclose(made(at, order), known(at, order), atol=tolerance)


def test_timing_imports_neither_matplotlib_nor_scipy() -> None:
    program = (
        "import sys; from rbxcompose.domains.arms.motion.parametrisation import toppra; toppra(); print(*sys.modules)"
    )
    there = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert "toppra" in there
    assert not {"matplotlib", "scipy"} & {*there}


@given(st.floats(0.01, 1.0), st.floats(-0.03, 0.03))
@example(0.01, 0.003)
def test_a_motion_of_any_speed_is_followed_by_a_joint_that_is_commanded_a_little_beside_its_start(
    share: float, beside: float
) -> None:
    limits, policy = MotionLimits(-3.0, 3.0, 1.5, 4.0), TrajectoryPolicy(tolerance=TrajectoryTolerance(goal=0.05))
    made = timed(np.array(((0.5,), (1.5,))), np.full(1, 1.5 * share), np.full(1, 4.0))
    assert isinstance(made, Trajectory)
    goal = trajectory_of(follow_goal(("elbow",), made), 0.0, 0)
    start, rules = {"elbow": JointSample(0.5 + beside)}, {"elbow": JointRules(limits)}
    plan = plan_trajectory(goal, 0.0, start, rules, policy)
    assert isinstance(plan, TrajectoryPlan), plan
    assert abs(plan.end - made.duration) < 1e-6
