"""Rays end where something solid begins, and nowhere else."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.ray_casting import Rays
from rbxcompose.domains.worlds.shapes import WorldBox, WorldCylinder, WorldShape
from tests.worlds.scenes import ANGLES, HEIGHT, grids, inside, shapes

MOST = 3.0
STEP = 0.5e-3  # of the samples of the reference [m]
GRAZE = 1e-7  # what passes so near to a side may hit it or not [m]
PLACES = st.one_of(st.floats(-2, 2), st.sampled_from((0.0, 0.5, -1.0, 0.25)))
EXACT = st.sampled_from([turn * math.pi / 4 for turn in range(-4, 5)])


@given(grids(), shapes(), PLACES, PLACES, st.lists(ANGLES | EXACT, min_size=1, max_size=6))
def test_a_ray_is_free_up_to_its_end_and_ends_at_something_solid(
    grid: GridMap, found: tuple[WorldShape, ...], x: float, y: float, angles: list[float]
) -> None:
    distances = Rays(grid).cast((x, y), angles, MOST, found, z=HEIGHT / 2)
    for angle, distance in zip(angles, distances.tolist(), strict=True):
        direction = np.array([math.cos(angle), math.sin(angle)])
        samples = np.arange(0.0, min(distance, MOST), STEP)
        assert not inside(grid, found, (x, y) + samples[:, None] * direction, -GRAZE).any()
        if math.isfinite(distance):
            assert inside(grid, found, (x, y) + distance * direction, GRAZE)


@given(grids(), PLACES, PLACES, st.lists(ANGLES, min_size=1, max_size=40), st.floats(0.05, 3.0))
def test_many_rays_are_what_each_is_alone_and_a_range_only_cuts(
    grid: GridMap, x: float, y: float, angles: list[float], most: float
) -> None:
    rays = Rays(grid)
    far = rays.cast((x, y), angles, 50.0)
    assert far.tolist() == [rays.cast((x, y), [angle], 50.0)[0] for angle in angles]
    np.testing.assert_allclose(rays.cast((x, y), angles, most), np.where(far < most, far, math.inf))


@given(st.integers(0, 499), st.integers(0, 499), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_far_hits_in_a_large_map_are_exact(row: int, column: int, u: float, v: float) -> None:
    cells = np.zeros((500, 500), np.int8)
    cells[row, column] = 100
    side, origin = 0.05, (-30.0, 40.0)
    target = np.array([(column + u) * side, (row + v) * side])
    along = target - origin
    slopes = [((low * side - at) / way, ((low + 1) * side - at) / way)
              for low, at, way in zip((column, row), origin, along, strict=True) if way]  # fmt: skip
    enters = max(min(pair) for pair in slopes) * math.hypot(*along)
    found = Rays(GridMap(cells, side)).cast(origin, [math.atan2(along[1], along[0])], 200.0)
    if 0.01 < u < 0.99 and 0.01 < v < 0.99:
        assert found[0] == pytest.approx(enters, abs=1e-6)


@given(st.floats(0.0, 1.0), st.sampled_from((WorldBox((0.4, 0.4, HEIGHT)), WorldCylinder(0.2, HEIGHT))))
def test_a_shape_is_seen_only_at_its_heights(z: float, solid: WorldBox | WorldCylinder) -> None:
    shape = WorldShape("shelf", solid, Pose2(1.0, 0.0), z=0.25)
    found = Rays(GridMap(np.zeros((1, 1), np.int8), 1.0)).cast((0.0, 0.0), [0.0], MOST, (shape,), z)
    assert found[0] == (pytest.approx(0.8) if 0.25 <= z <= 0.75 else math.inf)


def test_what_is_unknown_is_free_and_likely_cells_are_solid() -> None:
    grid = GridMap(np.array([[0, -1, 64, 65]], np.int8), 1.0)
    assert Rays(grid).cast((0.5, 0.5), [0.0], 10.0).tolist() == [2.5]
