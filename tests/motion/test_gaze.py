"""A head finds out how to look at a point, wherever its joints are, and never beyond their limits."""

from __future__ import annotations

import math
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.arms.motion.gaze import ENOUGH, Gaze
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.servos.limits import MotionLimits
from tests.body.described import described
from tests.shipped import robot_and_plan

PAN, TILT, CAMERA = "head_pan_joint", "head_tilt_joint", "camera_depth_frame"
LIMITS = {PAN: MotionLimits(-2.53, 2.53), TILT: MotionLimits(-1.57, 1.57)}
AHEAD = (2.0, 0.0, 1.0)
PANS, TILTS = st.floats(-2.5, 2.5), st.floats(-1.5, 1.5)


@cache
def body() -> Body:
    return described(robot_and_plan("pi_robot")[0].manifest).body


def gaze(limits: dict[str, MotionLimits] = LIMITS) -> Gaze:
    return Gaze(body(), CAMERA, limits)


@given(PANS, TILTS, st.floats(0.3, 20.0), PANS, TILTS)
def test_a_point_that_can_be_seen_is_looked_at_from_wherever_the_head_is(
    pan: float, tilt: float, away: float, pan_now: float, tilt_now: float
) -> None:
    point = body().poses({PAN: pan, TILT: tilt})[CAMERA].apply((away, 0.0, 0.0))
    found = gaze().aimed(point, {PAN: pan_now, TILT: tilt_now})
    assert found.angle < ENOUGH
    seen = body().poses(found.positions)[CAMERA].inverse().apply(point)
    assert math.atan2(math.hypot(*seen[1:]), seen[0]) == pytest.approx(found.angle, abs=1e-9)
    assert all(LIMITS[name].clamped(at) == at for name, at in found.positions.items())


@given(st.tuples(*[st.floats(-3, 3)] * 3), PANS, TILTS)
def test_it_never_leaves_the_limits_and_never_looks_further_past_than_before(
    point: tuple[float, float, float], pan: float, tilt: float
) -> None:
    narrow = {PAN: MotionLimits(-0.5, 0.8), TILT: MotionLimits(-0.2, 0.3)}
    here = {name: narrow[name].clamped(at) for name, at in ((PAN, pan), (TILT, tilt))}
    one = gaze(narrow)
    found = one.aimed(point, here)
    assert all(narrow[name].clamped(at) == at for name, at in found.positions.items())
    assert found.angle <= one.angle(point, here) + ENOUGH


def test_what_keeps_it_from_looking_at_a_point_is_named() -> None:
    found = gaze({**LIMITS, PAN: MotionLimits(-0.5, 0.5)}).aimed((0.0, 3.0, 1.0), {})
    assert found.blocked == (PAN,)
    assert math.degrees(found.angle) == pytest.approx(63, abs=4)


def test_joints_that_carry_the_head_count_where_they_are() -> None:
    tall, _ = robot_and_plan("porter")
    tilts = [
        Gaze(described(tall.manifest).body, CAMERA, LIMITS).aimed(AHEAD, {"torso_joint": lift}).positions[TILT]
        for lift in (0.0, 0.3)
    ]
    assert tilts[1] - tilts[0] > 0.1  # down is positive
