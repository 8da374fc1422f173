"""What an arm keeps on its way: at every fine point of the curves by other code, or a reason that names it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.inverse_kinematics import (
    PoseSearch,
    PoseSolutions,
    PoseTarget,
    Posture,
    kept_solutions,
)
from rbxcompose.domains.arms.motion.path_constraints import Keep, KeptTip
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionPlanner, MotionRequest, PlannerSettings
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from tests.motion.test_inverse_kinematics import ARM, SPACE
from tests.motion.test_planner import sampled
from tests.motion.test_tracing import OTHERS, READY, SIX, Free
from tests.motion.toy_arm import Array, ended

TILT = math.radians(10)
UPRIGHT = Keep((TILT, TILT, 0.0))


def frame_of(values: Array) -> Array:
    """Return the tip by another library, of shape (4, 4)."""
    return OTHERS.poses(dict(zip(SPACE.names, values.tolist(), strict=True)))["yourdfpy"]["tip"]


def request(goal: Array, keep: Keep) -> MotionRequest:
    kept = KeptTip(ARM, keep, READY) if keep.is_about_tip else None
    return MotionRequest(READY, goal, space=keep.narrowed(SPACE), kept=kept)


def tilt(array: Array, other: Array) -> float:
    """Return by how much what was up in one frame is tilted in the other [rad]."""
    up = array[:3, :3].T @ (0.0, 0.0, 1.0)
    return math.acos(min(1.0, float((other[:3, :3] @ up)[2])))


@settings(max_examples=2)
@given(st.integers(0, 2**31))
def test_the_tip_is_kept_upright_on_the_very_curves(seed: int) -> None:
    kept = KeptTip(ARM, UPRIGHT, READY)
    nearby = (kept.projected(one, SPACE) for one in SPACE.clamped(READY + 0.8 * (SPACE.samples(40, seed) / 2.6)))
    goal = next(array for array in nearby if array is not None)
    assert tilt(frame_of(READY), frame_of(goal)) < math.sqrt(2) * TILT
    found = ended(SIX.plan(request(goal, UPRIGHT)))
    assert isinstance(found, MotionPlan), found
    assert found.trajectory is not None
    first = frame_of(READY)
    for one in sampled(found.trajectory, 0.02):
        turn = frame_of(one)[:3, :3] @ first[:3, :3].T
        assert abs(math.atan2(-turn[1, 2], turn[2, 2])) <= TILT + 1e-6
        assert abs(math.asin(turn[0, 2])) <= TILT + 1e-6


@given(st.integers(0, 2**31))
def test_what_is_measured_changes_as_the_rates_say(seed: int) -> None:
    kept = KeptTip(ARM, Keep((0.2, 0.2, 0.2), ((0.0, 1.0), (0.0, 1.0), (0.0, 1.0))), READY)
    values, step = READY + SPACE.samples(1, seed)[0] / 8, 1e-6
    here, rates = kept._measured(values)
    for index in range(6):
        moved = values.copy()
        moved[index] += step
        assert np.allclose((kept._measured(moved)[0] - here) / step, rates[:, index], atol=1e-4)


def test_the_tip_stays_in_a_box_and_joints_in_their_ranges() -> None:
    z = float(frame_of(READY)[2, 3])
    keep = Keep(inside=(None, None, (z - 0.06, z + 0.06)), joints={"j1": (-0.5, 0.5), "j4": (0.0, 1.0)})
    kept, space = KeptTip(ARM, keep, READY), keep.narrowed(SPACE)
    goal = next(array for each in space.samples(60, 3) if (array := kept.projected(each, space)) is not None)
    found = ended(SIX.plan(request(goal, keep)))
    assert isinstance(found, MotionPlan), found
    assert found.trajectory is not None
    points = np.array(sampled(found.trajectory, 0.02))
    assert max(abs(frame_of(point)[2, 3] - z) for point in points) <= 0.06 + 1e-6
    assert np.abs(points[:, 0]).max() <= 0.5 + 1e-6
    assert points[:, 3].min() >= -1e-6


def test_positions_that_bring_the_tip_to_a_point_keep_it_upright() -> None:
    start = frame_of(READY)
    wanted = Transform3((start[0, 3] - 0.05, start[1, 3] + 0.05, start[2, 3]))
    target = PoseTarget(wanted, any_orientation=True)
    found = ended(kept_solutions(PoseSearch(ARM, SPACE, target, READY, Free().is_free, 1), UPRIGHT, READY, Free()))
    assert found.free
    for array in found.free:
        assert np.allclose(frame_of(array)[:3, 3], wanted.translation, atol=1e-3)
        assert tilt(start, frame_of(array)) < math.sqrt(2) * TILT
    far = PoseTarget(Transform3((9.0, 0.0, 0.0)), any_orientation=True)
    none = ended(kept_solutions(PoseSearch(ARM, SPACE, far, READY, Free().is_free, 1), UPRIGHT, READY, Free()))
    assert not none.free
    assert 7.0 < none.nearest[0] < 9.0


def test_a_goal_that_breaks_what_is_kept_says_what() -> None:
    goal = READY + 0.8 * np.eye(6)[1]
    found = ended(SIX.plan(request(goal, UPRIGHT)))
    assert isinstance(found, MotionFailure)
    assert found.reason is MotionReason.NOT_KEPT
    assert "at the goal, the tip's" in found.text
    narrow = ended(SIX.plan(request(goal, Keep(joints={"j2": (-1.2, -0.9)}))))
    assert isinstance(narrow, MotionFailure)
    assert narrow.reason is MotionReason.GOAL_OUTSIDE_LIMITS


def test_a_search_for_what_there_is_no_way_to_is_given_up_in_time() -> None:
    keep = Keep((1e-3, 1e-3, 1e-3), ((-9.0, 9.0), None, None))
    used = MotionPlanner(SPACE, Free(), PlannerSettings(time=0.05), lambda: 0.0)
    found = ended(used.plan(request(READY + 1e-3 * np.eye(6)[0], keep)))
    assert isinstance(found, MotionFailure)
    assert found.reason in (MotionReason.NO_PATH_IN_TIME, MotionReason.NOT_KEPT)


@pytest.mark.parametrize(
    ("keep", "named"),
    [
        (Keep((math.nan, 0.0, 0.0)), "a tolerance of 'keep'"),
        (Keep((-0.1, 0.0, 0.0)), "a tolerance of 'keep'"),
        (Keep(inside=((1.0, 0.0), None, None)), "does not go from less to more"),
        (Keep(inside=((0.0, math.nan), None, None)), "does not go from less to more"),
        (Keep(joints={"j9": (0.0, 1.0)}), "'j9' of 'keep' is no joint"),
        (Keep((0.1, 0.0, 0.0), frame="nowhere"), "there is no link 'nowhere'"),
        (Keep(), ""),
    ],
)
def test_what_cannot_be_kept_says_why(keep: Keep, named: str) -> None:
    assert named in keep.mistake(ARM)
    assert bool(named) is bool(keep.mistake(ARM))


def test_what_is_kept_leaves_room_for_a_posture() -> None:
    target = PoseTarget(Transform3(ARM.tip_pose(READY).translation), any_orientation=True, tolerance=1e-3)
    posture = Posture(np.array([0.0, -1.0, 1.0, 1.5, 0.5, 0.5]))
    space, keep = UPRIGHT.narrowed(SPACE), UPRIGHT

    def found(liked: Posture | None) -> PoseSolutions:
        return ended(
            kept_solutions(PoseSearch(ARM, space, target, READY, Free().is_free, 1), keep, READY, Free(), liked)
        )

    without, preferred = found(None).free, found(posture).free
    ways = [posture.distance(SPACE, array) for array in preferred]
    assert ways == sorted(ways)
    assert ways[0] <= min(posture.distance(SPACE, array) for array in without)
    assert all(KeptTip(ARM, keep, READY).is_kept(array) for array in preferred)
