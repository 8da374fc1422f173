"""Grasps that follow from a shape: fingers fit around it, close across it, and good ones come first."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy, rotate
from rbxcompose.domains.arms.motion.grasps import DEPTH, SHALLOW, extent, grasps_of, least_width
from rbxcompose.domains.body.model import Geometry

WIDEST = 0.1
SIZE = st.floats(0.005, 0.3)
SHAPES = st.one_of(
    st.tuples(SIZE, SIZE, SIZE).map(lambda size: Geometry("box", size)),
    st.tuples(SIZE, SIZE).map(lambda size: Geometry("cylinder", size)),
    SIZE.map(lambda radius: Geometry("sphere", (radius,))),
)
ANGLE = st.floats(-math.pi, math.pi)
AT = (0.3, -0.2, 0.7)


@given(SHAPES, ANGLE, st.sampled_from([0.0, math.pi / 2]), ANGLE)
def test_fingers_fit_around_what_they_hold(shape: Geometry, yaw: float, roll: float, bearing: float) -> None:
    pose = Transform3(AT, quaternion_from_rpy(roll, 0.0, yaw))
    found = grasps_of(shape, pose, bearing, WIDEST)
    for grasp in found:
        across, ahead = (rotate(grasp.pose.rotation, axis) for axis in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
        assert grasp.width == pytest.approx(2 * extent(shape, pose.rotation, across))
        assert least_width(shape) - 1e-9 <= grasp.width < WIDEST
        assert abs(across[2]) < 0.01  # fingers close in the horizontal
        reach = math.dist(grasp.pose.translation, AT)
        deep = max(0.0, extent(shape, pose.rotation, ahead) - DEPTH)
        assert min(abs(reach - deep - back) for back in SHALLOW) < 1e-9
    assert [one.quality for one in found] == sorted((one.quality for one in found), reverse=True)
    if least_width(shape) >= WIDEST:
        assert not found


def test_a_box_is_first_grasped_from_where_the_arm_is_and_then_at_seven_pitches() -> None:
    pose = Transform3(AT, quaternion_from_rpy(0.0, 0.0, 0.2))
    found = grasps_of(Geometry("box", (0.02, 0.04, 0.1)), pose, 0.0, WIDEST)
    first = [grasp.pose.rotation for grasp in found[:1]]
    assert rotate(first[0], (1.0, 0.0, 0.0)) == pytest.approx((math.cos(0.2), math.sin(0.2), 0.0))
    assert found[0].width == pytest.approx(0.04)
    assert len(found) == 7 * (2 + 4 * 3)  # from one side with both rolls, and from above at three depths


def test_what_lies_flat_can_only_be_grasped_across_its_narrow_side() -> None:
    plate = grasps_of(Geometry("box", (0.2, 0.05, 0.01)), Transform3(AT), 0.0, WIDEST)
    assert {round(grasp.width, 6) for grasp in plate} == {0.05}
