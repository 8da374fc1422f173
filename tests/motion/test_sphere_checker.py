"""The fast path: its answers are those of coal, its plans pass the same examinations, and where it fails OMPL plans."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import TOUCH, MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.groups import ArmGroup, ArmJoint, JointSpace, interpolated
from rbxcompose.domains.arms.motion.planner import LINE, MotionPlan, MotionRequest, first_bad
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.motion.sphere_checker import SphereChecker, Trees
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.arms.section_models import FAST
from rbxcompose.domains.body.model import Geometry
from rbxcompose.domains.servos.limits import MotionLimits
from tests.body.kinematics import description_of
from tests.motion.scenes import FLOOR, OCTREE, objects, poses, shapes, solids
from tests.motion.test_planner import LEFT, RIGHT, sampled
from tests.motion.toy_arm import FENCE, Array, ended, fast_planner, gap, kinematics, planner, urdf

ARM = kinematics()
SPACE = planner().space
ADJACENT = adjacent_pairs(ARM.body)
TREES = Trees()
SEEDS = st.integers(0, 2**31)
THINGS = st.lists(objects("thing", shapes | st.just(OCTREE)), max_size=1)


def both(mesh: MeshChecker, points: Array) -> tuple[int | None, int | None]:
    """Return the first bad point by the fast path, and by coal alone."""
    return SphereChecker(mesh, TREES).first_bad(points), first_bad(mesh, points)


@given(THINGS, st.lists(st.tuples(solids, poses), max_size=1), st.floats(0.0, 0.2), SEEDS)
def test_the_first_bad_position_of_many_is_that_of_coal(
    things: list[PlacedObject], held: list[tuple[Geometry, Transform3]], padding: float, seed: int
) -> None:
    there = [replace(placed_object, padding=padding) for placed_object in things]
    there += [PlacedObject("held", shape, "fore", pose, ("fore", "tip", "upper")) for shape, pose in held]
    mesh = MeshChecker(ARM, {}, ADJACENT, there, {"fore": 0.01})
    points = SPACE.samples(40, seed)
    for array in (points, interpolated(points[:2], 0.005), interpolated(points[2:4], 0.05)):
        mine, theirs = both(mesh, array)
        assert mine == theirs
        assert mine is None or mesh.colliding(array[mine])


def test_the_answers_follow_what_moves_beside_the_arm() -> None:
    arm = ArmKinematics(description_of(urdf()), ArmGroup(("lift", "bend"), "turret", "tip"))
    mesh = MeshChecker(arm, {}, ADJACENT)
    used, points = SphereChecker(mesh, TREES), SPACE.samples(50, 1)[:, 1:]
    verdicts = set()
    for turn in np.linspace(-1.0, 1.0, 9).tolist():
        arm.place({"turn": turn})
        assert used.first_bad(points) == first_bad(mesh, points)
        verdicts.add(used.first_bad(points))
    assert len(verdicts) > 1


@settings(max_examples=settings().max_examples // 2)
@given(SEEDS)
def test_a_fast_plan_is_free_and_within_all_limits_by_other_code(seed: int) -> None:
    used = fast_planner()
    body = description_of(urdf()).body
    start, goal = [sample for sample in SPACE.samples(60, seed) if gap(body, sample) > 0.01][:2]
    found = ended(used.plan(MotionRequest(start, goal)))
    assert isinstance(found, MotionPlan), found
    assert found.trajectory is not None
    assert found.found_by in (LINE, FAST), found.fast_failed
    points = sampled(found.trajectory, 0.005)
    assert np.allclose(points[0], start)
    assert np.allclose(points[-1], goal)
    assert min(gap(body, point) for point in points) >= -TOUCH
    assert found.trajectory.excess(np.full(3, 2.0), np.full(3, 4.0)) <= 1.0 + 1e-9


@given(objects("thing", solids), SEEDS)
def test_what_the_fast_path_plans_coal_alone_finds_free(thing: PlacedObject, seed: int) -> None:
    used, mesh = fast_planner(things=[thing]), MeshChecker(ARM, {}, ADJACENT, [thing])
    free = [sample for sample in SPACE.samples(60, seed) if mesh.is_free(sample)][:2]
    if len(free) < 2:
        return
    found = ended(used.plan(MotionRequest(free[0], free[1])))
    if isinstance(found, MotionPlan) and found.trajectory is not None:
        assert all(mesh.is_free(one) for one in found.trajectory.dense(0.004))
    else:
        assert isinstance(found, MotionFailure)
        assert found.reason in (MotionReason.NO_PATH_IN_TIME, MotionReason.PATH_IN_COLLISION)


def test_a_seed_gives_the_same_fast_way_again_and_another_one_another() -> None:
    found = [ended(fast_planner(seed=seed).plan(MotionRequest(LEFT, RIGHT))) for seed in (3, 3, 4)]
    ways = [plan.waypoints.tobytes() for plan in found if isinstance(plan, MotionPlan) and plan.found_by == FAST]
    assert len(ways) == 3
    assert ways[0] == ways[1] != ways[2]


def test_shortcuts_make_the_way_shorter() -> None:
    lengths = []
    for simplify in (True, False):
        found = ended(fast_planner(simplify=simplify, attempts=20).plan(MotionRequest(LEFT, RIGHT)))
        assert isinstance(found, MotionPlan), found
        lengths.append(np.linalg.norm(np.diff(found.waypoints, axis=0), axis=1).sum())
    assert lengths[0] < lengths[1]


def test_a_start_where_only_spheres_collide_is_left_to_ompl_which_is_told() -> None:
    x, y, z = ARM.poses(LEFT)["tip"].translation
    cone = Geometry("cone", (0.1, 0.2))  # it is taken for a cylinder
    near = PlacedObject("cone", cone, "ground", Transform3((x + 0.07, y, z - 0.09)))
    used = fast_planner(things=[near], time=2.0)
    assert used.checker.is_free(LEFT)
    found = ended(used.plan(MotionRequest(LEFT, RIGHT)))
    if isinstance(found, MotionPlan):
        assert (found.found_by, found.fast_failed) == ("rrt_connect", "spheres collide at the start")
    else:
        assert "fast: spheres collide at the start" in found.text


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("triangles", [(0, 1, 2), (0, 1, 2, 1, 3, 2)])
def test_a_flat_mesh_is_in_the_way_on_both_paths(axis: int, triangles: tuple[int, ...]) -> None:
    corners = np.roll(np.array(((0.0, -0.2, -0.2), (0.0, 0.2, -0.2), (0.0, 0.0, 0.3), (0.0, 0.3, 0.3))), axis, axis=1)
    flat = Geometry("mesh", points=tuple(corners.ravel().tolist()), triangles=triangles)
    at = Transform3(ARM.poses(LEFT)["tip"].translation)
    mesh = MeshChecker(ARM, {}, ADJACENT, [PlacedObject("plate", flat, "ground", at)])
    assert ("fore", "plate") in mesh.colliding(LEFT)
    assert both(mesh, LEFT[None]) == (0, 0)


def test_a_goal_behind_a_fence_is_given_up_in_time_on_both_paths() -> None:
    found = ended(fast_planner(FENCE, time=0.2).plan(MotionRequest(LEFT, RIGHT)))
    assert isinstance(found, MotionFailure)
    assert found.reason is MotionReason.NO_PATH_IN_TIME
    assert "rrt_connect found none in 0.2 s" in found.text
    assert "fast: none in 0.05 s" in found.text


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        (LEFT, np.array([math.nan, 0.0, 0.0]), MotionReason.GOAL_OUTSIDE_LIMITS),
        (np.array([math.inf, 0.0, 0.0]), LEFT, MotionReason.START_OUTSIDE_LIMITS),
        (LEFT, np.array([0.8, 3.0, 0.0]), MotionReason.GOAL_OUTSIDE_LIMITS),
        (np.zeros(3), LEFT, MotionReason.START_IN_COLLISION),
        (LEFT, np.zeros(3), MotionReason.GOAL_IN_COLLISION),
    ],
)
def test_what_cannot_be_has_the_same_reason_on_both_paths(start: Array, goal: Array, reason: MotionReason) -> None:
    slow, quick = (
        ended(motion_planner.plan(MotionRequest(start, goal))) for motion_planner in (planner(), fast_planner())
    )
    assert isinstance(quick, MotionFailure)
    assert quick.reason is reason
    assert quick == slow


def test_a_plane_keeps_its_padding_on_the_fast_path() -> None:
    floor = PlacedObject("floor", FLOOR, "ground", Transform3((0.0, 0.0, 0.1)), ("ground",), padding=0.12)
    mine, theirs = both(MeshChecker(ARM, {}, ADJACENT, [floor]), SPACE.samples(200, 2))
    assert mine == theirs is not None


def test_joints_that_slide_and_joints_that_mimic_move_their_spheres() -> None:
    text = """<robot name="r"><link name="base"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
    </link><link name="a"><collision><geometry><box size="0.1 0.1 0.02"/></geometry></collision></link>
    <link name="b"><collision><geometry><cylinder radius="0.03" length="0.2"/></geometry></collision></link>
    <joint name="up" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.6" effort="1" velocity="1"/></joint>
    <joint name="turn" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0.15 0 -0.15"/>
    <axis xyz="0 1 0"/><mimic joint="up" multiplier="5" offset="0.3"/></joint></robot>"""
    arm = ArmKinematics(description_of(text), ArmGroup(("up",), "base", "b"))
    space = JointSpace((ArmJoint("up", MotionLimits(0.0, 0.6), slides=True),))
    mesh = MeshChecker(arm, {}, ())
    points = np.sort(space.samples(300, 1), axis=0)
    verdicts = [mesh.is_free(point) for point in points]
    assert 10 < sum(verdicts) < 290
    used = SphereChecker(mesh, Trees())
    assert [used.first_bad(point[None]) is None for point in points] == verdicts
    for begin in range(0, 300, 20):
        assert used.first_bad(points[begin:]) == first_bad(mesh, points[begin:])
