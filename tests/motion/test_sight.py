"""That a sensor sees a target on the whole way: by formulas of its cone among balls, on the very curves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.path_constraints import Keep, KeptSight, KeptTip, SightLine
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionPlanner, MotionRequest, PlannerSettings
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.body.model import Geometry
from tests.loops import for_all
from tests.motion.test_planner import sampled
from tests.motion.toy_arm import Array, ended, kinematics, planner

TOY, SPACE = kinematics(), planner().space
FIELD = math.radians(25)
WATCHED = (0.9, 0.0, 0.6)
"""A point above the wall, which a camera at the tip looks at."""
BALL = 0.03


def thing(x: float, y: float, z: float, link: str = "ground") -> PlacedObject:
    return PlacedObject("ball", Geometry("sphere", (BALL,)), link, Transform3((x, y, z)))


def checker(*things: PlacedObject) -> MeshChecker:
    return MeshChecker(TOY, {}, adjacent_pairs(TOY.body), things)


def frames(values: Array) -> dict[str, Transform3]:
    return TOY.body.poses(dict(zip(SPACE.names, values.tolist(), strict=True)))


def off_axis(values: Array, point: tuple[float, float, float]) -> float:
    """Return by how much a point is off the x axis of the tip [rad]."""
    x, y, z = frames(values)["tip"].inverse().apply(point)
    return math.atan2(math.hypot(y, z), x)


def from_cone(eye: Array, point: Array, radius: float, middle: Array) -> float:
    """Return how far a point is from a cone [m], in the half plane through its axis; 0 if it is in it."""
    length = float(np.linalg.norm(point - eye))
    along = float((middle - eye) @ (point - eye)) / length
    here = np.array((along, float(np.linalg.norm(middle - eye - along * (point - eye) / length))))
    if along <= length and here[1] <= along * radius / length:
        return 0.0
    side, base = np.array((length, radius)), np.array((0.0, radius))
    nearest = side * np.clip(here @ side / (side @ side), 0.0, 1.0)
    end = np.array((length, np.clip(here[1], 0.0, base[1])))
    return float(min(np.linalg.norm(here - nearest), np.linalg.norm(here - end)))


@given(
    st.tuples(st.floats(0.5, 0.95), st.floats(-0.1, 0.1), st.floats(0.45, 0.75)),
    st.tuples(*(st.floats(low, high) for low, high in ((-0.5, 0.5), (0.2, 0.8), (-0.3, 0.3)))),
    st.floats(0.01, 0.1),
)
def test_a_ball_is_in_the_way_if_and_only_if_it_is_in_the_cone(
    at: tuple[float, float, float], positions: tuple[float, float, float], radius: float
) -> None:
    values = np.array(positions)
    sight = KeptSight("tip", at=WATCHED, radius=radius, angle=math.pi, through=("ground", "upper"))
    line = SightLine(TOY, sight, checker(thing(*at)))
    eye = np.array(frames(values)["tip"].translation)
    away = from_cone(eye, np.array(WATCHED), radius, np.array(at))
    assume(abs(away - BALL) > 1e-4)
    assert line.blocking(values, eye, np.array(WATCHED)) == (["ball"] if away < BALL else [])


@given(st.integers(0, 2**31))
def test_the_angle_changes_as_the_rates_say(seed: int) -> None:
    values = SPACE.samples(1, seed)[0]
    line = SightLine(TOY, KeptSight("tip", at=WATCHED), checker())
    assert line.angle(values) == pytest.approx(off_axis(values, WATCHED), abs=1e-6)
    assume(0.05 < line.angle(values) < 3.0)
    for index, rate in enumerate(line.rates(values)):
        moved = values + 1e-5 * np.eye(3)[index]
        assert (off_axis(moved, WATCHED) - off_axis(values, WATCHED)) / 1e-5 == pytest.approx(rate, abs=1e-2)


def planned(keep: Keep, start: Array, goal: Array, *things: PlacedObject) -> MotionPlan | MotionFailure:
    used = MotionPlanner(SPACE, checker(*things), PlannerSettings(), lambda: 0.0)
    kept = KeptTip(TOY, keep, start, used.checker)
    return ended(used.plan(MotionRequest(start, goal, space=keep.narrowed(SPACE), kept=kept)))


LEFT, RIGHT = np.array([0.2, 1.3, 1.3]), np.array([-0.2, 1.25, 1.3])


def test_the_camera_sees_what_it_watches_on_the_very_curves() -> None:
    found = planned(Keep(sight=KeptSight("tip", at=WATCHED, angle=FIELD, through=("ground",))), LEFT, RIGHT)
    assert isinstance(found, MotionPlan), found
    assert found.trajectory is not None
    assert max(off_axis(one, WATCHED) for one in sampled(found.trajectory, 0.02)) <= FIELD + 1e-6


def test_what_is_before_the_target_is_named() -> None:
    eye = np.array(frames(RIGHT)["tip"].translation)
    middle = tuple((0.3 * eye + 0.7 * np.array(WATCHED)).tolist())
    found = planned(
        Keep(sight=KeptSight("tip", at=WATCHED, angle=FIELD, through=("ground",))), LEFT, RIGHT, thing(*middle)
    )
    assert isinstance(found, MotionFailure)
    assert found.reason is MotionReason.NOT_KEPT
    assert found.text == "at the goal, 'ball' is before what 'tip' is to see"


def test_a_link_of_the_arm_may_be_before_what_a_camera_of_the_body_sees() -> None:
    behind = KeptSight("ground", "tip", angle=math.pi)
    line = SightLine(TOY, behind, checker())
    assert line.is_free(np.array([0.0, 1.5, 0.0])) is False  # the upper link is between the ground and the tip
    words = "; ".join(line.beyond(np.array([0.0, 1.5, 0.0])))
    assert "'upper' is before what 'ground' is to see" in words


@for_all(
    "sight, named",
    [
        (KeptSight("nowhere"), "there is no link 'nowhere'"),
        (KeptSight("tip", "nowhere"), "there is no link 'nowhere'"),
        (KeptSight(""), "needs a 'sensor'"),
        (KeptSight("tip", along="w"), "not along 'w'"),
        (KeptSight("tip", at=(math.nan, 0.0, 0.0)), "no finite target"),
        (KeptSight("tip", radius=-1.0), "a radius that is not above 0"),
        (KeptSight("tip", angle=4.0), "beyond 180 deg"),
        (KeptSight("tip"), ""),
    ],
)
def test_what_cannot_be_seen_says_why(sight: KeptSight, named: str) -> None:
    assert named in Keep(sight=sight).mistake(TOY)
    assert bool(named) is bool(Keep(sight=sight).mistake(TOY))
