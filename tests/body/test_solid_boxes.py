"""Boxes within shapes, and how far two of them reach into each other."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, Vector3, quaternion_from_rpy, rotate
from rbxcompose.domains.arms.checks import SolidBox, box_within, penetration
from rbxcompose.domains.body.model import Geometry

lengths = st.floats(0.01, 2.0)
places = st.tuples(*[st.floats(-2.0, 2.0)] * 3)
turns = st.tuples(*[st.floats(-math.pi, math.pi)] * 3).map(lambda rpy: quaternion_from_rpy(*rpy))
shares = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
boxes = st.builds(SolidBox, st.builds(Transform3, places, turns), st.tuples(lengths, lengths, lengths))


def _at(box: SolidBox, share: Vector3) -> Vector3:
    """Return a point of a box, given as shares of its half lengths."""
    x, y, z = (part * half for part, half in zip(share, box.half, strict=True))
    return box.pose.apply((x, y, z))


@given(boxes, boxes, shares)
def test_boxes_with_a_point_in_common_are_not_apart(one: SolidBox, other: SolidBox, share: Vector3) -> None:
    point = _at(one, share)
    inside = other.pose.inverse().apply(point)
    if all(abs(at) < half for at, half in zip(inside, other.half, strict=True)):
        assert penetration(one, other) >= -1e-9


@given(boxes, boxes)
def test_the_order_of_two_boxes_does_not_matter(one: SolidBox, other: SolidBox) -> None:
    assert penetration(one, other) == pytest.approx(penetration(other, one), abs=1e-9)


@given(boxes, turns, st.floats(0.001, 1.0), st.tuples(lengths, lengths, lengths))
def test_boxes_on_both_sides_of_a_plane_are_apart(
    one: SolidBox, turn: tuple[float, float, float, float], gap: float, half: Vector3
) -> None:
    radius = math.hypot(*one.half) + math.hypot(*half)
    x, y, z = rotate(turn, (1.0, 0.0, 0.0))
    ax, ay, az = one.pose.translation
    away = radius + gap
    other = SolidBox(Transform3((ax + x * away, ay + y * away, az + z * away), turn), half)
    assert penetration(one, other) < 0.0


@given(
    st.sampled_from([Geometry("box", (1.0, 2.0, 0.5)), Geometry("cylinder", (0.5, 2.0)), Geometry("sphere", (0.7,))]),
    st.builds(Transform3, places, turns),
    shares,
)
def test_no_part_of_a_box_is_outside_of_its_shape(shape: Geometry, pose: Transform3, share: Vector3) -> None:
    box = box_within(shape, pose)
    assert box is not None
    x, y, z = pose.inverse().apply(_at(box, share))
    within = {
        "box": max(abs(x) - 0.5, abs(y) - 1.0, abs(z) - 0.25),
        "cylinder": max(math.hypot(x, y) - 0.5, abs(z) - 1.0),
        "sphere": math.hypot(x, y, z) - 0.7,
    }
    assert within[shape.kind] < 1e-9


def test_a_mesh_has_no_simple_box() -> None:
    assert box_within(Geometry("mesh", (1.0, 1.0, 1.0), "part.stl"), Transform3()) is None
