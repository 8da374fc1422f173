"""A map as rectangles is the same map."""

from __future__ import annotations

import numpy as np
from hypothesis import given

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap, wall_rectangles
from tests.worlds.scenes import grids


@given(grids())
def test_rectangles_cover_each_occupied_cell_once_and_no_other(grid: GridMap) -> None:
    count = np.zeros(grid.cells.shape, int)
    for left, low, right, high in wall_rectangles(grid):
        count[low:high, left:right] += 1
    assert (count == (grid.cells >= SOLID)).all()


def test_a_wall_is_one_rectangle_whichever_way_it_goes() -> None:
    cells = np.zeros((40, 50), np.int8)
    cells[5:7, 3:45] = cells[20:38, 10:12] = 100
    assert sorted(map(tuple, wall_rectangles(GridMap(cells, 0.1, Pose2())).tolist())) == [
        (3, 5, 45, 7),
        (10, 20, 12, 38),
    ]
