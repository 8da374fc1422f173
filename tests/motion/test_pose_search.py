"""Inverse kinematics as goals ask for it: orientations alone, the nearest pose, and the posture that is preferred."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.inverse_kinematics import (
    EDGE,
    PoseSearch,
    PoseSolutions,
    PoseTarget,
    Posture,
    descended,
    searched,
    solved,
)
from tests.body.kinematics import Three, matrix
from tests.motion.test_inverse_kinematics import ARM, DESCRIPTION, GROUP, SPACE
from tests.motion.toy_arm import Array, ended
from tests.soak import rare

SEEDS = st.integers(0, 2**31)
KINDS = st.sampled_from(({}, {"any_orientation": True}, {"any_position": True}))
OTHERS = Three(DESCRIPTION)
LEFT = 0.7  # [rad] that the first joint does not turn beyond where that counts


@pytest.fixture(scope="module", params=["compiled", *rare("plain")])
def arm(request: pytest.FixtureRequest) -> ArmKinematics:
    """Return the arm, which searches by plain or by compiled code."""
    return ARM if request.param == "plain" else fast()


@cache
def fast() -> ArmKinematics:
    assert GROUP is not None
    found = ArmKinematics(DESCRIPTION, GROUP)
    assert found.hasten()
    return found


def search(arm: ArmKinematics, target: PoseTarget, posture: Posture | None = None, most: float = 9.0) -> PoseSolutions:
    return ended(
        searched(PoseSearch(arm, SPACE, target, np.zeros(6), lambda values: bool(values[0] < most), 1), posture)
    )


def elsewhere(seed: int) -> Transform3:
    """Return a pose that the arm mostly cannot take: it is 1.3 m long."""
    where, turned = np.random.default_rng(seed).uniform(-2.0, 2.0, 3), ARM.tip_pose(SPACE.samples(1, seed)[0])
    return Transform3((float(where[0]), float(where[1]), float(where[2])), turned.rotation)


@given(SEEDS)
def test_a_tip_whose_position_does_not_count_is_turned_as_is_wanted_by_other_libraries(
    arm: ArmKinematics, seed: int
) -> None:
    pose = elsewhere(seed)
    found = search(arm, PoseTarget(pose, any_position=True, angle_tolerance=1e-4))
    assert found.free
    for values in found.free:
        assert not SPACE.outside(values)
        for frames in OTHERS.poses(dict(zip(SPACE.names, values.tolist(), strict=True))).values():
            assert np.allclose(frames["tip"][:3, :3], matrix(pose)[:3, :3], atol=2e-4)


@given(SEEDS)
def test_plain_and_compiled_code_turn_the_tip_in_the_same_steps(seed: int) -> None:
    target = PoseTarget(elsewhere(seed), any_position=True)
    first = SPACE.samples(1, seed + 1)[0]
    (array, away), (other, missed) = (descended(each, SPACE, target, first) for each in (ARM, fast()))
    assert np.allclose(away, missed, atol=1e-6)
    assert np.allclose(array, other, atol=1e-5)


@settings(max_examples=10)
@given(SEEDS, KINDS)
def test_what_will_do_approximately_is_met_exactly_where_it_can_be(
    arm: ArmKinematics, seed: int, kind: dict[str, bool]
) -> None:
    pose = ARM.tip_pose(SPACE.samples(1, seed)[0])
    exact, found = (search(arm, PoseTarget(pose, **kind, is_approximate=flag)) for flag in (False, True))
    assert not found.is_approximate
    assert [array.tolist() for array in found.free] == [array.tolist() for array in exact.free]


@settings(max_examples=4)
@given(SEEDS, st.booleans())
def test_no_small_step_gets_nearer_than_what_is_approximate_and_the_start_is_not(
    arm: ArmKinematics, seed: int, any_way: bool
) -> None:
    target = PoseTarget(elsewhere(seed), any_way, is_approximate=True)
    found = search(arm, target)
    assume(found.is_approximate)
    best = target.excess(ARM.tip_pose(found.free[0]))
    assert best <= target.excess(ARM.tip_pose(np.zeros(6)))
    assert not target.is_met(ARM.tip_pose(found.free[0]))
    steps = np.random.default_rng(seed).uniform(-0.05, 0.05, (200, 6))
    for moved in np.clip(found.free[0] + steps, SPACE.lower + EDGE, SPACE.upper - EDGE):
        assert target.excess(ARM.tip_pose(moved)) >= best - max(1.0, 1e-3 * best)
    order = [target.excess(ARM.tip_pose(array)) for array in found.free]
    assert order == sorted(order)


@pytest.mark.soak
@settings(max_examples=3)
@given(SEEDS)
def test_plain_and_compiled_code_get_as_near(seed: int) -> None:
    target = PoseTarget(elsewhere(seed), is_approximate=True)
    one, other = (search(each, target).free for each in (ARM, fast()))
    assert np.allclose(one, other, atol=1e-5)


@settings(max_examples=4)
@given(SEEDS)
def test_what_is_approximate_is_free_and_never_farther_away_than_the_start(arm: ArmKinematics, seed: int) -> None:
    goal = SPACE.samples(1, seed)[0]
    goal[0] = abs(goal[0])
    target = PoseTarget(ARM.tip_pose(goal), is_approximate=True)
    found = search(arm, target, most=0.05)
    assert found.free
    assert all(values[0] < 0.05 for values in found.free)
    best = target.excess(ARM.tip_pose(found.free[0]))
    assert best <= target.excess(ARM.tip_pose(np.zeros(6)))
    assert found.is_approximate is not target.is_met(ARM.tip_pose(found.free[0]))


def test_nothing_is_approximate_unless_that_is_asked_for_and_nothing_that_collides_will_do(arm: ArmKinematics) -> None:
    far = Transform3((5.0, 0.0, 0.3))
    assert search(arm, PoseTarget(far)).free == ()
    assert not search(arm, PoseTarget(far)).is_approximate
    assert search(arm, PoseTarget(far, is_approximate=True), most=-9.0).free == ()


@given(SEEDS, SEEDS, KINDS)
def test_a_preferred_posture_is_never_farther_than_without_and_keeps_the_pose(
    arm: ArmKinematics, seed: int, other: int, kind: dict[str, bool]
) -> None:
    target = PoseTarget(ARM.tip_pose(SPACE.samples(1, seed)[0]), **kind)
    posture = Posture(SPACE.samples(1, other)[0])
    without, found = (search(arm, target, one, LEFT) for one in (None, posture))
    assume(without.free)
    nearest = min(posture.distance(SPACE, array) for array in without.free)
    ways = [posture.distance(SPACE, array) for array in found.free]
    assert ways[0] <= nearest + 1e-9
    assert ways == sorted(ways)
    for values in found.free:
        assert values[0] < LEFT
        assert not SPACE.outside(values)
        assert target.is_met(ARM.tip_pose(values))


@pytest.mark.soak
@settings(max_examples=10)
@given(SEEDS, KINDS)
def test_plain_and_compiled_code_prefer_the_same(seed: int, kind: dict[str, bool]) -> None:
    goal, liked = SPACE.samples(2, seed)
    one, other = (search(each, PoseTarget(ARM.tip_pose(goal), **kind), Posture(liked)).free for each in (ARM, fast()))
    assert len(one) == len(other)
    assert np.allclose(one[0], other[0], atol=1e-4)


@settings(max_examples=10)
@given(SEEDS, KINDS)
def test_a_posture_that_has_the_pose_is_taken(arm: ArmKinematics, seed: int, kind: dict[str, bool]) -> None:
    liked = SPACE.inside(2 * EDGE).samples(1, seed)[0]
    posture = Posture(liked)
    found = search(arm, PoseTarget(ARM.tip_pose(liked), **kind), posture)
    assert posture.distance(SPACE, found.free[0]) < 1e-6


def test_joints_that_a_posture_leaves_out_may_be_anywhere() -> None:
    posture = Posture.of(SPACE.names, {"j3": 0.5})
    assert posture.distance(SPACE, np.full(6, 0.5)) == pytest.approx(0.0)
    assert posture.guess(np.ones(6)).tolist() == [1.0, 1.0, 0.5, 1.0, 1.0, 1.0]
    found = search(ARM, PoseTarget(Transform3((0.7, 0.2, 0.4)), any_orientation=True), posture)
    assert found.free[0][2] == pytest.approx(0.5, abs=2e-3)


def test_a_joint_without_an_end_takes_the_shorter_way_to_a_posture() -> None:
    posture = Posture.of(SPACE.names, {"j4": math.pi - 0.1})
    assert posture.distance(SPACE, np.array((0.0, 0.0, 0.0, 0.1 - math.pi, 0.0, 0.0))) == pytest.approx(0.2)


def test_a_preferred_posture_is_left_only_as_far_as_something_is_in_the_way() -> None:
    target, liked = PoseTarget(Transform3((0.7, 0.2, 0.4)), any_orientation=True), Posture.of(SPACE.names, {"j1": 1.0})
    without: list[Array] = []
    for most in (9.0, 0.3):
        first = search(ARM, target, liked, most).free[0]
        without += [first]
    assert without[1][0] < 0.3
    assert liked.distance(SPACE, without[0]) < liked.distance(SPACE, without[1])


def test_solutions_that_slide_together_count_once() -> None:
    target, liked = PoseTarget(Transform3((0.7, 0.2, 0.4)), any_orientation=True), Posture.of(SPACE.names, {"j3": 0.5})
    found = search(ARM, target, liked).free
    for number, array in enumerate(found):
        assert all(float(np.abs(array - other).max()) > 0.01 for other in found[:number])
    plain = ended(solved(PoseSearch(ARM, SPACE, target, np.zeros(6), lambda values: True, seed=1)))
    assert len(found) <= len(plain.free) + 1
