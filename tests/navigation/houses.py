"""Maps for tests of navigation."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.costs import INSCRIBED, LETHAL, NO_INFORMATION, LayeredCosts
from rbxcompose.domains.navigation.planner import PlannedPath
from rbxcompose.domains.worlds.grid_map import GridMap

SIDE = 0.05  # [m]


def room(*walls: tuple[float, float, float, float], size: float = 6.0) -> GridMap:
    """Return a square room around the origin [m], with further walls from (x0, y0) to (x1, y1)."""
    count = round(size / SIDE)
    cells = np.zeros((count, count), np.int8)
    cells[:2] = cells[-2:] = 100
    cells[:, :2] = cells[:, -2:] = 100
    for x0, y0, x1, y1 in walls:
        (left, right), (low, high) = (
            [round((value + size / 2) / SIDE) for value in pair] for pair in ((x0, x1), (y0, y1))
        )
        cells[low:high, left:right] = 100
    return GridMap(cells, SIDE, Pose2(-size / 2, -size / 2))


ONE_WALL = room((-0.1, -1.6, 0.1, 1.6))
HOUSE = room((-0.1, -3, 0.1, -0.6), (-0.1, 0.6, 0.1, 3), (-3, 0.0, -1.6, 0.2), (1.2, -1.0, 3, -0.8), size=7.0)


def is_blocked(costs: LayeredCosts, x: float, y: float) -> bool:
    """Return whether a robot must not be at a point of `map` [m]."""
    value = costs.value_at(x, y)
    return value in (INSCRIBED, LETHAL) or (value == NO_INFORMATION and not costs.settings.unknown_is_free)


def length_of(way: PlannedPath) -> float:
    """Return how long a way is [m]."""
    return sum(before.distance(after) for before, after in pairwise(way.poses))
