"""The second examination of motions: it agrees with a formula, and looks often enough."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.collisions import adjacent_pairs
from rbxcompose.domains.arms.motion.figures import NO_TRIES, SecondChecker, Tries, motion_tries, sampled
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.body.model import Geometry
from tests.body.kinematics import description_of
from tests.motion.toy_arm import gap, planner, urdf

DESCRIPTION, JOINTS = description_of(urdf()), ("turn", "lift", "bend")
ALLOWED = adjacent_pairs(DESCRIPTION.body)
PLANNER = planner()


@given(st.integers(0, 2**31))
def test_what_is_free_is_what_a_formula_says(seed: int) -> None:
    checker = SecondChecker(DESCRIPTION, JOINTS, ALLOWED)
    values = PLANNER.space.samples(1, seed)[0]
    distance = gap(DESCRIPTION.body, values)
    if abs(distance) > 1e-3:
        assert checker.is_free(values) is (distance > 0.0)


def test_an_object_is_hit_where_a_link_holds_it_and_not_by_what_may_touch_it() -> None:
    elbow = Transform3((-0.3, 0.0, 0.0))
    ball = PlacedObject("ball", Geometry("sphere", (0.05,)), "tip", elbow, touches=("upper",))
    at_wall, away = np.array([0.0, 0.0, 0.0]), np.array([1.5, 0.5, 0.0])
    free = [SecondChecker(DESCRIPTION, JOINTS, ALLOWED, [ball]).is_free(one) for one in (away, at_wall)]
    assert free == [True, False]
    untouchable = PlacedObject("ball", ball.shape, "tip", elbow)
    assert not SecondChecker(DESCRIPTION, JOINTS, ALLOWED, [untouchable]).is_free(away)


def test_fingers_that_follow_each_other_and_not_the_arm_do_not_count() -> None:
    ball = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    slide = '<parent link="tip"/><child link="{0}"/><limit lower="0" upper="1" effort="1" velocity="1"/>'
    fingers = f"""<link name="left">{ball}</link><link name="right">{ball}</link>
    <joint name="grip" type="prismatic">{slide.format("left")}</joint>
    <joint name="grip_too" type="prismatic">{slide.format("right")}<mimic joint="grip"/></joint></robot>"""
    description = description_of(urdf().replace("</robot>", fingers))
    allowed = adjacent_pairs(description.body) | {("fore", "left"), ("fore", "right")}
    for joints, is_free in ((JOINTS, True), ((*JOINTS, "grip"), False)):
        away = np.array([1.5, 0.5, 0.0, 0.0])[: len(joints)]
        assert SecondChecker(description, joints, allowed).is_free(away) is is_free


def test_samples_of_a_curve_are_as_near_as_was_asked_for() -> None:
    positions = np.array([[0.0, 0.0], [0.5, 1.0], [0.4, 1.2]])
    velocities = np.array([[0.0, 0.0], [0.4, 2.0], [0.0, 0.0]])
    points = sampled(Trajectory(np.array([0.0, 1.0, 1.5]), positions, velocities), 0.01)
    assert np.abs(np.diff(points, axis=0)).max() <= 0.01
    assert points[0] == pytest.approx(positions[0])
    assert points[-1] == pytest.approx(positions[-1])


def test_figures_count_what_was_planned_what_was_not_and_what_collides_after_all() -> None:
    ticks = iter(range(100))
    free, hit = np.array([1.5, 0.5, 0.0]), np.array([0.0, 0.0, 0.0])
    pairs = [(free, np.array([1.0, 0.5, 0.2])), (free, hit)]
    found = motion_tries(PLANNER, pairs, lambda trajectory, step: False, lambda: float(next(ticks)))
    assert (found.count, found.solved, found.colliding, found.times) == (2, 1, 1, (1.0, 1.0))
    assert found.length == pytest.approx(np.hypot(0.5, 0.2), rel=1e-6)
    assert found.failures[0].startswith("goal_in_collision")
    assert NO_TRIES.with_(found) == found
    assert Tries(20, 20, tuple(map(float, range(20)))).p95 == 19.0
