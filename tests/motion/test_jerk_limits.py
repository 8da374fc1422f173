"""Limits of jerk: the same path, from rest to rest, with speeds, accelerations and jerks within their limits."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rbxcompose.domains.arms.motion.groups import ArmJoint, JointSpace
from rbxcompose.domains.arms.motion.parametrisation import PathTiming, Trajectory, jerks_between, jerks_of, timed
from rbxcompose.domains.servos.limits import MotionLimits

Array = NDArray[np.float64]
SEEDS = st.integers(0, 2**31)
FAST, HARD = np.array((1.0, 2.0, 0.5)), np.array((2.0, 6.0, 1.5))


def points(seed: int, count: int) -> Array:
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (count, 3))


@given(SEEDS, st.integers(2, 7), st.floats(0.5, 200.0), st.booleans())
def test_all_limits_are_kept_from_rest_to_rest(seed: int, count: int, jerk: float, is_one: bool) -> None:
    way, jerks = points(seed, count), np.array((jerk, np.inf if is_one else 2 * jerk, np.inf if is_one else jerk))
    found = timed(way, FAST, HARD, jerks)
    assert isinstance(found, Trajectory), found
    assert np.array_equal(found.positions[[0, -1]], way[[0, -1]])
    assert not np.any(found.velocities[[0, -1]])
    assert np.all(np.diff(found.times) > 0.0)
    assert found.excess(FAST, HARD) <= 1.0 + 1e-9
    assert np.all(np.abs(jerks_between(found.times, found.velocities)) <= jerks * (1.0 + 1e-6))


@settings(max_examples=settings().max_examples // 2)
@given(SEEDS, st.integers(2, 7), st.floats(1.0, 100.0))
def test_the_path_is_the_one_without_a_limit_of_jerk(seed: int, count: int, jerk: float) -> None:
    way = points(seed, count)
    found = timed(way, FAST, HARD, np.full(3, jerk))
    assert isinstance(found, Trajectory), found
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    spline = CubicSpline(along, way, bc_type="natural")
    curve = spline(np.linspace(0.0, along[-1], 20_000))
    for position in found.positions[::5]:
        assert np.linalg.norm(curve - position, axis=1).min() < 4e-3


@given(st.lists(st.floats(0.05, 2.0), min_size=2, max_size=30), st.floats(0.01, 3.0), SEEDS)
def test_a_mean_goes_forward_all_the_way_with_the_window_longer(steps: list[float], window: float, seed: int) -> None:
    way = np.cumsum([0.0, *steps])
    speeds = np.array((0.0, *np.random.default_rng(seed).uniform(0.1, 2.0, len(steps) - 1), 0.0))
    timing = PathTiming(way, speeds)
    times, places, paces = timing.mean(window, 400)
    assert times[-1] == timing.times[-1] + window
    assert np.isclose(places[0], 0.0, atol=1e-9)
    assert np.isclose(places[-1], way[-1])
    assert np.all(np.diff(places) >= -1e-9)
    assert paces.max() <= speeds.max() + 1e-9
    walked = np.concatenate([[0.0], np.cumsum(np.diff(times) * (paces[1:] + paces[:-1]) / 2)])
    assert np.allclose(walked, places, atol=0.02 * way[-1])


def test_joints_without_a_limit_have_none_and_without_any_nothing_changes() -> None:
    joints = [ArmJoint("a", MotionLimits(jerk=4.0)), ArmJoint("b", MotionLimits())]
    assert jerks_of(JointSpace(tuple(joints[1:]))) is None
    limits = jerks_of(JointSpace(tuple(joints)))
    assert limits is not None
    assert limits.tolist() == [4.0, np.inf]


def test_a_smaller_jerk_takes_longer_and_a_large_one_hardly() -> None:
    way = points(3, 4)
    plain, *limited = (timed(way, FAST, HARD, one) for one in (None, np.full(3, 1e3), np.full(3, 4.0)))
    durations = [one.duration for one in (plain, *limited) if isinstance(one, Trajectory)]
    assert 0.9 * durations[0] < durations[1] < 1.1 * durations[0]
    assert durations[1] < durations[2] < 3.0 * durations[1]
