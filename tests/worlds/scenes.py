"""Small worlds at random, and what is inside of their solids, found point by point."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import WorldBox, WorldCylinder, WorldShape

Points = NDArray[np.float64]
ANGLES = st.floats(-math.pi, math.pi)
HEIGHT = 0.5


@st.composite
def grids(draw: st.DrawFn) -> GridMap:
    """Maps up to 2 m around the origin, which begin and turn anywhere."""
    rows, columns = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    values = draw(st.lists(st.sampled_from((0, 0, 0, 0, -1, 100)), min_size=rows * columns, max_size=rows * columns))
    side = draw(st.sampled_from((0.05, 0.1, 0.25)))
    corner = Pose2(draw(st.floats(-2, 0.5)), draw(st.floats(-2, 0.5)), draw(st.sampled_from((0.0, 0.0, 0.3, -2.0))))
    return GridMap(np.array(values, np.int8).reshape(rows, columns), side, corner)


@st.composite
def shapes(draw: st.DrawFn) -> tuple[WorldShape, ...]:
    """Up to three boxes and cylinders."""
    found = []
    for name in "abc"[: draw(st.integers(0, 3))]:
        pose = Pose2(draw(st.floats(-2, 2)), draw(st.floats(-2, 2)), draw(ANGLES))
        sizes = st.floats(0.02, 0.6)
        solid = draw(
            st.builds(WorldCylinder, sizes, st.just(HEIGHT))
            | st.builds(WorldBox, st.tuples(sizes, sizes, st.just(HEIGHT)))
        )
        found.append(WorldShape(name, solid, pose))
    return tuple(found)


def moved_into(pose: Pose2, points: Points) -> Points:
    """Return points of `map` in the frame of a pose."""
    x, y = points[..., 0] - pose.x, points[..., 1] - pose.y
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return np.stack((x * cos + y * sin, y * cos - x * sin), -1)


def inside(grid: GridMap, found: tuple[WorldShape, ...], points: Points, grown: float) -> NDArray[np.bool_]:
    """Return which points are inside of something solid that has grown by a length [m]."""
    local = moved_into(grid.origin, points)
    hit = np.zeros(points.shape[:-1], bool)
    for row, column in np.argwhere(grid.cells == 100):
        away = np.abs(local - ((column + 0.5) * grid.resolution, (row + 0.5) * grid.resolution))
        hit |= (away <= grid.resolution / 2 + grown).all(-1)
    for shape in found:
        away = np.abs(moved_into(shape.pose, points))
        match shape.solid:
            case WorldBox(size=(x, y, _)):
                hit |= (away <= (x / 2 + grown, y / 2 + grown)).all(-1)
            case WorldCylinder(radius=radius):
                hit |= np.hypot(away[..., 0], away[..., 1]) <= radius + grown
    return hit
