"""Inverse kinematics: what it finds is there by other code, and what it does not find has a distance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.arrays import Array
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.groups import ArmGroup, ArmJoint, JointSpace, chain
from rbxcompose.domains.arms.motion.inverse_kinematics import (
    EDGE,
    PoseSearch,
    PoseSolutions,
    PoseTarget,
    descended,
    nearest_poses,
    solved,
)
from rbxcompose.domains.servos.limits import MotionLimits
from tests.body.kinematics import Three, description_of, matrix
from tests.motion.toy_arm import ended

AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
LIMIT = '<limit lower="-2.6" upper="2.6" effort="1" velocity="1"/>'


def six_joints() -> str:
    """Return an arm of six joints: the fourth turns without an end, and a finger on the last link mimics the fifth."""
    parts = ['<robot name="six"><link name="l0"/>']
    for number, axis in enumerate(AXES, 1):
        kind = "continuous" if number == 4 else "revolute"
        parts.append(
            f'<link name="l{number}"/><joint name="j{number}" type="{kind}"><origin xyz="0.2 0 0.05"/>'
            f'<parent link="l{number - 1}"/><child link="l{number}"/><axis xyz="{axis}"/>{LIMIT}</joint>'
        )
    parts.append(
        '<link name="tip"/><joint name="finger" type="revolute"><origin xyz="0.1 0 0"/><parent link="l6"/>'
        f'<child link="tip"/><axis xyz="0 0 1"/><mimic joint="j5" multiplier="-0.5" offset="0.1"/>{LIMIT}</joint>'
        "</robot>"
    )
    return "".join(parts)


DESCRIPTION = description_of(six_joints())
GROUP = chain(DESCRIPTION.body, "l0", "tip")
assert GROUP is not None
ARM = ArmKinematics(DESCRIPTION, GROUP)
LIFTED = description_of(
    six_joints().replace('axis xyz="0 0 1"', 'axis xyz="0 0.6 0.8"').replace("revolute", "prismatic", 1)
)
LIFT_GROUP = chain(LIFTED.body, "l1", "tip")  # its first joint is none of the arm's
SPACE = JointSpace(
    tuple(
        ArmJoint(name, MotionLimits() if name == "j4" else MotionLimits(-2.6, 2.6), is_continuous=name == "j4")
        for name in GROUP.joints
    )
)


@pytest.fixture(scope="module", params=["plain", "compiled"])
def arm(request: pytest.FixtureRequest) -> ArmKinematics:
    """Return the arm, which searches by plain or by compiled code."""
    if request.param == "plain":
        return ARM
    assert GROUP is not None
    fast = ArmKinematics(DESCRIPTION, GROUP)
    assert fast.hasten()
    return fast


def solve(arm: ArmKinematics, target: PoseTarget, free: bool = True) -> PoseSolutions:
    return ended(solved(PoseSearch(arm, SPACE, target, np.zeros(6), lambda values: free, seed=1)))


@given(st.integers(0, 2**31))
def test_each_solution_is_at_the_target_by_two_other_libraries_and_within_limits(arm: ArmKinematics, seed: int) -> None:
    goal = SPACE.samples(1, seed)[0]
    pose = ARM.tip_pose(goal)
    found = solve(arm, PoseTarget(pose, tolerance=1e-4, angle_tolerance=1e-4))
    assert found.free
    for values in found.free:
        assert not SPACE.outside(values)
        assert abs(values[3]) <= math.pi + 1e-9  # the turn nearest to the start
        positions = dict(zip(SPACE.names, values.tolist(), strict=True))
        for frames in Three(DESCRIPTION).poses(positions).values():
            assert np.allclose(frames["tip"], matrix(pose), atol=2e-4)


@settings(max_examples=10)
@given(st.integers(0, 2**31))
def test_the_jacobian_is_what_small_steps_do(seed: int) -> None:
    values, step = SPACE.samples(1, seed)[0], 1e-6
    for index in range(6):
        moved = values.copy()
        moved[index] += step
        error, _ = ARM.error(values, ARM.placement(ARM.tip_pose(moved)))
        _, jacobian = ARM.error(values, ARM.placement(ARM.tip_pose(values)))
        assert np.allclose(error / step, jacobian[:, index], atol=1e-4)


def test_the_same_seed_finds_the_same_and_the_nearest_comes_first(arm: ArmKinematics) -> None:
    target = PoseTarget(ARM.tip_pose(np.array([0.4, -0.7, 1.0, 0.3, -0.6, 0.2])))
    first, second = solve(arm, target), solve(arm, target)
    assert [array.tolist() for array in first.free] == [array.tolist() for array in second.free]
    ways = [float(np.max(np.abs(array))) for array in first.free]
    assert ways == sorted(ways)


def test_what_is_out_of_reach_tells_how_near_the_tip_gets(arm: ArmKinematics) -> None:
    found = solve(arm, PoseTarget(Transform3((5.0, 0.0, 0.3)), any_orientation=True))
    assert (found.free, found.colliding) == ((), ())
    assert 3.5 < found.nearest[0] < 4.0


def test_a_target_at_a_limit_is_met_just_before_it_so_that_curves_through_solutions_stay_within(
    arm: ArmKinematics,
) -> None:
    found = solve(arm, PoseTarget(ARM.tip_pose(np.array([0.4, 2.6, 1.0, 0.3, -0.6, 0.2]))))
    assert found.free
    for values in found.free:
        assert np.all(np.delete(np.abs(values), 3) <= 2.6 - EDGE)


@given(st.integers(0, 2**31), st.booleans())
def test_plain_and_compiled_code_take_the_same_way(seed: int, any_orientation: bool) -> None:
    assert GROUP is not None
    fast = ArmKinematics(DESCRIPTION, GROUP)
    fast.hasten()
    goal, first = SPACE.samples(2, seed)
    target = PoseTarget(ARM.tip_pose(goal), any_orientation)
    (array, away), (other, missed) = (descended(each, SPACE, target, first) for each in (ARM, fast))
    assert np.allclose(away, missed, atol=1e-6)
    assert np.allclose(array, other, atol=1e-5)


def compiled_for(function: object) -> list[object]:
    """Return the types that numba has compiled a function for, none if it comes from a library."""
    return [*getattr(vars(function).get("dispatcher"), "signatures", ())]


def test_nothing_is_compiled_anew_while_an_arm_works() -> None:
    from rbxcompose.domains.arms.motion.compiled_descent import _descents

    assert GROUP is not None
    fast = ArmKinematics(DESCRIPTION, GROUP)
    fast.hasten()
    before = compiled_for(_descents)
    first = np.zeros((6, 2))[:, 0]
    first.flags.writeable = False
    for any_orientation in (False, True):
        descended(fast, SPACE, PoseTarget(Transform3(), any_orientation, 1, 1), first)
    assert compiled_for(_descents) == before


def test_compiled_code_follows_where_other_joints_are(arm: ArmKinematics) -> None:
    assert LIFT_GROUP is not None
    lifted = ArmKinematics(LIFTED, LIFT_GROUP)
    assert arm is ARM or lifted.hasten()
    space = JointSpace(tuple(ArmJoint(name, MotionLimits(-2.6, 2.6)) for name in LIFT_GROUP.joints))
    for lift in (0.0, 0.7):
        lifted.place({"j1": lift})
        pose = lifted.tip_pose(np.full(5, 0.4))
        values, _ = descended(lifted, space, PoseTarget(pose), np.full(5, 0.3))
        assert PoseTarget(pose).is_met(lifted.tip_pose(values))


def test_solutions_that_collide_are_told_apart(arm: ArmKinematics) -> None:
    found = solve(arm, PoseTarget(ARM.tip_pose(np.full(6, 0.3))), free=False)
    assert not found.free
    assert found.colliding


@pytest.mark.parametrize(
    ("target", "named"),
    [
        (PoseTarget(Transform3((math.nan, 0.0, 0.0))), "not a finite pose"),
        (PoseTarget(Transform3(rotation=(0.0, 0.0, 0.0, 0.0))), "no rotation"),
        (PoseTarget(Transform3(), tolerance=0.0), "tolerance"),
        (PoseTarget(Transform3()), ""),
    ],
)
def test_a_target_that_is_none_says_why(target: PoseTarget, named: str) -> None:
    assert named in target.mistake
    assert bool(named) is bool(target.mistake)


def test_a_search_ends_with_its_restarts_or_its_time(arm: ArmKinematics) -> None:
    far = PoseTarget(Transform3((9.0, 0.0, 0.0)))
    start = np.zeros(6)
    for restarts in (0, 3):
        found = ended(solved(PoseSearch(arm, SPACE, far, start, lambda values: True, seed=1, restarts=restarts)))
        assert found.attempts == restarts + 1
    late = ended(solved(PoseSearch(arm, SPACE, far, start, lambda values: True, seed=1, is_late=lambda: True)))
    assert late.attempts == 1


def test_the_nearest_pose_is_free_though_each_joint_is_a_little_off(arm: ArmKinematics) -> None:
    target = PoseTarget(Transform3((3.0, 0.1, 0.3)), any_orientation=True)  # out of reach

    def nearest(most: float) -> Array:
        """Return the first pose whose tip is before a wall [m]."""
        search = PoseSearch(arm, SPACE, target, np.zeros(6), lambda values: tip(values) < most, seed=1)
        return ended(nearest_poses(search))[0]

    def tip(values: Array) -> float:
        return arm.tip_pose(values).translation[0]

    wall = tip(nearest(math.inf)) + 1e-6  # it would touch there
    found = nearest(wall)
    assert all(tip(found + sign * 0.004 * joint) < wall for joint in np.eye(6) for sign in (1.0, -1.0))


def test_a_search_leaves_joints_alone_that_do_not_move_the_tip() -> None:
    description = description_of(six_joints().replace('parent link="l3"', 'parent link="l1"'))
    forked = ArmKinematics(description, ArmGroup(SPACE.names, "l0", "tip"))  # j2 and j3 are a branch of their own
    target, start = PoseTarget(forked.tip_pose(np.full(6, 0.4)), any_orientation=True), np.full(6, 0.2)
    for search in (solved, nearest_poses):
        tries = list[Array]()

        def is_free(values: Array, tries: list[Array] = tries) -> bool:
            tries.append(values)
            return len(tries) > 3  # so that it begins from random positions

        ended(search(PoseSearch(forked, SPACE, target, start, is_free, seed=1)))
        assert len(tries) > 3
        assert all((values[1:3] == 0.2).all() for values in tries)
