"""Ways of the tip: on the lines and arcs that were asked for by other code, without jumps, or a reason and how far."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionPlanner, PlannerSettings
from rbxcompose.domains.arms.motion.trace_planner import TraceWish, WayPoint, planned_trace
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.body.link_pairs import LinkPair
from rbxcompose.domains.body.model import Geometry
from tests.body.kinematics import Three
from tests.motion.test_inverse_kinematics import ARM, DESCRIPTION, SPACE
from tests.motion.test_planner import sampled
from tests.motion.toy_arm import Array, ended, gap, kinematics, planner

OTHERS = Three(DESCRIPTION)
TOY, TOY_PLANNER = kinematics(), planner()
READY = np.array([0.2, -1.0, 1.6, 0.5, 1.2, -0.4])
CLEAR = np.array([0.8, 0.0, 0.2])


class Free:
    """Nothing to collide with."""

    def is_free(self, values: Array) -> bool:
        return True

    def colliding(self, values: Array) -> list[LinkPair]:
        return []

    def without(self, pairs: Collection[LinkPair]) -> Free:
        return self

    def in_the_way(self, values: Array, shape: Geometry, at: Transform3, ignored: Collection[str]) -> list[str]:
        return []


SIX = MotionPlanner(SPACE, Free(), PlannerSettings(), lambda: 0.0)


def point(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.0, via: bool = False) -> WayPoint:
    return WayPoint(Transform3((x, y, z), quaternion_from_rpy(0.0, 0.0, yaw)), via)


def trace(
    wish: TraceWish, start: Array = READY, arm: ArmKinematics = ARM, used: MotionPlanner = SIX
) -> MotionPlan | MotionFailure:
    return ended(planned_trace(arm, used, wish, start, Transform3()))


def trajectory_of(found: MotionPlan | MotionFailure) -> Trajectory:
    assert isinstance(found, MotionPlan), found
    assert found.trajectory is not None
    return found.trajectory


def tips(trajectory: Trajectory, step: float = 0.02) -> Array:
    """Return where the tip is on the curves of the controller, by another library, of shape (m, 4, 4)."""
    names = SPACE.names
    return np.array(
        [
            OTHERS.poses(dict(zip(names, one.tolist(), strict=True)))["yourdfpy"]["tip"]
            for one in sampled(trajectory, step)
        ]
    )


def angle_between(array: Array, other: Array) -> float:
    return math.acos(min(1.0, max(-1.0, (float(np.trace(array[:3, :3].T @ other[:3, :3])) - 1.0) / 2.0)))


def away_from_line(points: Array, first: Array, last: Array) -> float:
    """Return the greatest distance of points from a line between two points [m]."""
    along = last - first
    shares = np.clip((points - first) @ along / (along @ along), 0.0, 1.0)
    return float(np.linalg.norm(points - first - shares[:, None] * along, axis=1).max())


@settings(max_examples=4)
@given(st.integers(0, 2**31))
def test_the_tip_keeps_to_its_line_and_turns_evenly_or_tells_how_far_it_gets(seed: int) -> None:
    random = np.random.default_rng(seed)
    x, y, z = random.uniform(-0.15, 0.15, 3).tolist()
    found = trace(TraceWish((point(x, y, z, random.uniform(-0.8, 0.8)),), relative=True), SPACE.samples(1, seed)[0])
    if isinstance(found, MotionFailure):
        assert found.reason is MotionReason.PATH_INCOMPLETE
        assert 0.0 <= found.share < 1.0
        return
    frames = tips(trajectory_of(found))
    first, last, whole = frames[0][:3, 3], frames[-1][:3, 3], angle_between(frames[0], frames[-1])
    assert np.allclose(last - first, (x, y, z), atol=1e-3)
    assert away_from_line(frames[:, :3, 3], first, last) < 1e-3
    for frame in frames:
        share = float(np.linalg.norm(frame[:3, 3] - first) / np.linalg.norm(last - first))
        assert angle_between(frames[0], frame) == pytest.approx(share * whole, abs=math.radians(0.6))
        assert angle_between(frames[0], frame) + angle_between(frame, frames[-1]) < whole + math.radians(0.5)
    assert np.abs(np.diff(sampled(trajectory_of(found), 0.02), axis=0)).max() <= 0.02 + 1e-9  # no joint jumps


def test_the_tip_is_as_fast_as_was_asked_for_between_rest_and_rest() -> None:
    made = trajectory_of(trace(TraceWish((point(0.1),), relative=True, speed=0.05)))
    positions = [ARM.tip_pose(position).translation for position in made.positions]
    speeds = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.diff(made.times)
    assert speeds.max() < 0.0505
    assert np.median(speeds) == pytest.approx(0.05, rel=0.02)


def test_a_circle_stays_at_its_radius() -> None:
    half = (point(0.05, 0.05, via=True), point(0.1))
    frames = tips(trajectory_of(trace(TraceWish((*half, point(0.05, -0.05, via=True), point()), relative=True))))
    middle = frames[0][:3, 3] + (0.05, 0.0, 0.0)
    assert np.allclose(np.linalg.norm(frames[:, :3, 3] - middle, axis=1), 0.05, atol=1e-3)
    assert np.ptp(frames[:, 1, 3]) == pytest.approx(0.1, abs=2e-3)


def test_a_corner_is_passed_at_rest_or_cut_from_where_it_was_asked_to() -> None:
    corner = (point(0.06), point(0.06, 0.06, yaw=0.3))
    for blend, nearest, rests in ((0.0, 0.0, 1), (0.02, 0.02 * math.sqrt(2) / 4, 0)):
        made = trajectory_of(trace(TraceWish(corner, relative=True, blend=blend)))
        frames = tips(made, 0.01)
        points = frames[:, :3, 3] - frames[0][:3, 3]
        distances = np.linalg.norm(points - (0.06, 0.0, 0.0), axis=1)
        assert distances.min() == pytest.approx(nearest, abs=1.2e-3)
        before = points[distances > blend]
        assert np.minimum(np.abs(before[:, 1]), np.abs(before[:, 0] - 0.06)).max() < 1e-3
        still = np.all(np.abs(made.velocities[1:-1]) < 1e-9, axis=1)
        assert still.sum() == rests


def test_a_way_into_a_wall_goes_as_far_as_it_is_free_if_that_is_enough() -> None:
    wish = TraceWish((point(0.0, -0.8),), relative=True, any_orientation=True)
    found = trace(wish, CLEAR, TOY, TOY_PLANNER)
    assert isinstance(found, MotionFailure)
    assert found.reason is MotionReason.PATH_INCOMPLETE
    assert "'ground' collide" in found.text
    assert 0.1 < found.share < 0.9
    part = TraceWish(wish.points, relative=True, any_orientation=True, least=found.share - 0.01)
    made = trace(part, CLEAR, TOY, TOY_PLANNER)
    assert isinstance(made, MotionPlan)
    assert made.share == pytest.approx(found.share)
    assert min(gap(TOY.body, one) for one in sampled(trajectory_of(made), 0.01)) >= -1e-4


def test_a_singularity_on_the_way_is_a_jump_and_none_is_made() -> None:
    high = np.array([0.3, 1.2, 0.9])
    tip = TOY.tip_pose(high).translation
    past = TraceWish((point(-2 * tip[0], -2 * tip[1] - 0.002),), relative=True, any_orientation=True)
    found = trace(past, high, TOY, TOY_PLANNER)
    assert isinstance(found, MotionFailure)
    assert found.reason is MotionReason.PATH_INCOMPLETE
    assert found.share > 0.05


NAN, LINE = point(math.nan), point(0.05)


@pytest.mark.parametrize(
    ("wish", "named"),
    [
        (TraceWish((NAN,)), "not a finite pose: point 1"),
        (TraceWish((LINE, WayPoint(Transform3(rotation=(0.0, 0.0, 0.0, 0.0))))), "no rotation: point 2"),
        (TraceWish(()), "no points"),
        (TraceWish((LINE,), speed=math.nan), "speed"),
        (TraceWish((LINE,), blend=-1.0), "blend"),
        (TraceWish((LINE,), least=math.nan), "no share"),
    ],
)
def test_what_is_no_way_says_why(wish: TraceWish, named: str) -> None:
    assert named in wish.mistake


@pytest.mark.parametrize(
    ("points", "blend", "named"),
    [
        ((point(0.05, via=True),), 0.0, "an arc, which has no end"),
        ((point(0.05, via=True), point(0.1)), 0.0, "in one line"),
        ((point(0.05, via=True), point(0.1, 0.1, via=True), point(0.1)), 0.0, "another one in the middle"),
        ((point(0.05), point(0.05, 0.05)), 0.06, "line 1 is 5.0 cm long, too short"),
        ((point(0.05), point(0.05, 0.05), point(0.0, 0.05)), 0.03, "too short for corners of 3.0 cm"),
    ],
)
def test_points_that_no_way_leads_through_say_why(points: tuple[WayPoint, ...], blend: float, named: str) -> None:
    found = trace(TraceWish(points, relative=True, blend=blend))
    assert isinstance(found, MotionFailure)
    assert found.reason is MotionReason.UNKNOWN_GOAL
    assert named in found.text


def test_a_way_without_a_length_moves_nothing_and_one_without_an_end_ends() -> None:
    nowhere = trace(TraceWish((point(), point()), relative=True))
    assert isinstance(nowhere, MotionPlan)
    assert nowhere.trajectory is None
    far = trace(TraceWish((point(1e12),)))
    assert isinstance(far, MotionFailure)
    assert far.reason is MotionReason.PATH_INCOMPLETE
