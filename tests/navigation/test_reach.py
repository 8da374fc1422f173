"""Where a robot fits, and from where it can come where."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.costs import CostSettings, CostZone, LayeredCosts
from rbxcompose.domains.navigation.planner import NoPathError, plan
from rbxcompose.domains.navigation.reach import ReachableAreas
from rbxcompose.domains.worlds.contact import overlap
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import CircleFootprint, WorldBox, WorldShape
from tests.navigation.houses import SIDE, room
from tests.worlds.scenes import grids, shapes

WEST, EAST = (-2.0, 0.0), (2.0, 0.5)
ZONE = CostZone("stairs", ((-0.6, -0.5), (0.4, -0.3), (0.1, 0.7)))


@given(grids(), st.floats(0.01, 0.6), st.booleans())
def test_areas_are_those_that_the_planner_connects(grid: GridMap, radius: float, unknown_is_free: bool) -> None:
    ground = ReachableAreas(grid, radius, (), [ZONE], unknown_is_free=unknown_is_free)
    costs = LayeredCosts(grid, CostSettings(radius, radius, unknown_is_free=unknown_is_free), [ZONE])
    free = costs.values < 253 if not unknown_is_free else (costs.values != 253) & (costs.values != 254)
    connected, count = label(free, np.ones((3, 3)))
    assert ((ground.areas > 0) == free).all()
    pairs = {*zip(connected[free].tolist(), ground.areas[free].tolist(), strict=True)}
    assert len(pairs) == count == len({area for _, area in pairs})


@given(grids(), shapes(), st.floats(0.05, 0.5))
def test_a_robot_touches_nothing_where_it_fits_and_fits_where_it_has_room(
    grid: GridMap, things: tuple[WorldShape, ...], radius: float
) -> None:
    ground = ReachableAreas(grid, radius, things)
    for row, column in np.ndindex(*grid.cells.shape):
        x, y = grid.to_points((column + 0.5, row + 0.5)).tolist()
        depth, _ = overlap(grid, things, CircleFootprint(radius), Pose2(x, y))
        if ground.areas[row, column]:
            assert depth < 1e-9
        else:
            assert overlap(grid, things, CircleFootprint(radius + 1.01 * grid.resolution), Pose2(x, y))[0] > 0


@given(st.floats(0.3, 1.2), st.floats(0.1, 0.5))
def test_the_bottleneck_is_where_and_as_wide_as_the_door(width: float, radius: float) -> None:
    grid = room((-0.1, -3, 0.1, 1 - width / 2), (-0.1, 1 + width / 2, 0.1, 3))
    ground = ReachableAreas(grid, radius)
    if ground.area_at(WEST) == ground.area_at(EAST):
        return
    found = ground.bottleneck(WEST, EAST)
    assert found is not None
    assert math.dist(found[1], (0.0, 1.0)) < width / 2 + 0.2
    for share, fits in ((1.0, True), (1.1, False)):
        costs = LayeredCosts(grid, CostSettings(radius=share * found[0]))
        try:
            plan(costs, Pose2(*WEST), Pose2(*EAST), 0.1)
        except NoPathError:
            assert not fits
        else:
            assert fits or found[0] * 0.1 < SIDE / 2


def test_walls_all_around_have_no_bottleneck() -> None:
    ground = ReachableAreas(room((-0.1, -3, 0.1, 3)), 0.2)
    assert ground.bottleneck(WEST, EAST) is None
    away, spot, area = ground.nearest(EAST, ground.area_at(WEST))
    np.testing.assert_allclose((away, spot[0]), (2.36, -0.36), atol=0.05)
    assert area == ground.area_at(WEST)


def test_a_thing_in_the_door_closes_it() -> None:
    grid = room((-0.1, -3, 0.1, -0.5), (-0.1, 0.5, 0.1, 3))
    thing = WorldShape("chest", WorldBox((0.6, 0.5, 0.5)), Pose2(0.0, 0.0, 0.3))
    is_open, is_closed = (ReachableAreas(grid, 0.2, things) for things in ((), (thing,)))
    assert is_open.area_at(WEST) == is_open.area_at(EAST) != 0
    assert is_closed.area_at(WEST) != is_closed.area_at(EAST)
    assert is_closed.area_at((0.0, 0.0)) == is_closed.area_at((90.0, 0.0)) == 0
