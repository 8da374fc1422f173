"""Shapes and the ways on which they move."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.shapes import Point2, PolygonFootprint, ShapePath, WorldCylinder, WorldShape

NUMBERS = st.floats(-10, 10)


@st.composite
def paths(draw: st.DrawFn) -> ShapePath:
    times = sorted(draw(st.sets(st.integers(-50, 50), min_size=1, max_size=5)))
    return ShapePath(tuple((time / 5, draw(NUMBERS), draw(NUMBERS)) for time in times), draw(st.booleans()))


@given(paths(), st.floats(-20, 20), st.floats(0, 0.01))
def test_a_path_leads_through_its_points_without_jumps_between_them(path: ShapePath, time: float, dt: float) -> None:
    first, last = path.points[0][0], path.points[-1][0]
    for at, x, y in path.points[: -1 if path.repeats and last > first else None]:
        assert path.place_at(at) == pytest.approx((x, y))
    fastest = 20 * math.sqrt(2) / 0.2
    if first <= time and time + dt <= last - 1e-9:
        assert math.dist(path.place_at(time), path.place_at(time + dt)) <= fastest * dt + 1e-9
    if path.repeats and time > last > first:
        assert path.place_at(time) == pytest.approx(path.place_at(first + (time - first) % (last - first)))


def test_it_stands_before_and_after_its_path_with_its_own_heading() -> None:
    person = WorldShape("ann", WorldCylinder(0.2, 1.7), Pose2(heading=0.5), path=ShapePath(((1, 0, 0), (3, 4, 2))))
    assert [person.pose_at(time) for time in (0, 2, 9)] == [Pose2(0, 0, 0.5), Pose2(2, 1, 0.5), Pose2(4, 2, 0.5)]
    assert person.at(2).pose == person.at(2).pose_at(99) == Pose2(2, 1, 0.5)


@pytest.mark.parametrize("points", [(), ((0, 0, 0), (0, 1, 1)), ((math.nan, 0, 0),), ((0, math.inf, 0),)])
def test_a_path_that_leads_nowhere_is_refused(points: tuple[tuple[float, float, float], ...]) -> None:
    with pytest.raises(ValueError, match="path"):
        ShapePath(points)


@pytest.mark.parametrize(
    "points", [(), ((0, 0), (1, 0)), ((0, 0), (2, 0), (1, 0.5), (1, 2)), ((0, 0), (1, 0), (2, 0)), ((0, 0),) * 3]
)
def test_a_footprint_that_is_not_convex_is_refused(points: tuple[Point2, ...]) -> None:
    with pytest.raises(ValueError, match="convex"):
        PolygonFootprint(points)
    star = tuple((math.cos(turn * 0.8 * math.pi), math.sin(turn * 0.8 * math.pi)) for turn in range(5))
    with pytest.raises(ValueError, match="convex"):
        PolygonFootprint(star)


def test_corners_may_be_given_in_either_direction() -> None:
    points = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    assert PolygonFootprint(points).points == points
    assert PolygonFootprint(points[::-1]) == PolygonFootprint(points[::-1])
    assert set(PolygonFootprint(points[::-1]).points) == set(points)


def test_a_corner_on_an_edge_or_written_twice_is_none() -> None:
    third = ((0.0, 0.0), (0.1, 0.1), (0.3, 0.3), (0.0, 1.0))  # the second is off the line by rounding
    assert PolygonFootprint(third).points == (third[0], *third[2:])
    assert PolygonFootprint((*third, third[0])).points == (*third[2:], third[0])
