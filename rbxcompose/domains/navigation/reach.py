"""Where a robot fits on a map, and from where it can come where: as the planner has it.

In numpy alone: to import scipy takes longer than all checks of a robot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rbxcompose.base.arrays import Bools, Ints32, np
from rbxcompose.domains.navigation.costs import CostZone
from rbxcompose.domains.worlds.contact import outside_polygon
from rbxcompose.domains.worlds.grid_map import SOLID, UNKNOWN, GridMap
from rbxcompose.domains.worlds.shapes import Point2, WorldBox, WorldCylinder, WorldHull, WorldShape

HALVINGS = 6  # in the search for a radius that fits


class ReachableAreas:
    """The cells of a map in which the middle of a robot may be, by areas that no way connects.

    Walls, zones to keep out of and standing things count; what is beside the map does not belong to it. Cells of walls
    block as those of `LayeredCosts` do.
    """

    def __init__(
        self,
        grid: GridMap,
        radius: float,
        things: Sequence[WorldShape] = (),
        zones: Sequence[CostZone] = (),
        *,
        unknown_is_free: bool = True,
    ) -> None:
        """Take the radius of the robot [m]."""
        self.grid, self.radius = grid, radius
        self._things = things
        self._walls = grid.cells >= SOLID
        for zone in zones:
            if not zone.share:
                self._walls = self._walls | zone.cells(grid)
        self._unknown = np.zeros_like(self._walls) if unknown_is_free else grid.cells == UNKNOWN
        self.areas = self.with_radius(radius)
        """(rows, columns): 0 where the robot does not fit, else the number of the area."""

    def with_radius(self, radius: float) -> Ints32:
        """Return the areas of a robot of another radius [m]."""
        side = self.grid.resolution
        blocked = _grown(self._walls, radius / side + 1) | self._unknown
        for thing in self._things:
            self._block(blocked, thing, radius + side / 2)
        return _labelled(~blocked)

    def area_at(self, place: Point2) -> int:
        """Return the number of the area at a point of `map` [m]; 0 where the robot does not fit, or beside the map."""
        return int(self.grid.look_up(self.areas, place, 0))

    def nearest(self, place: Point2, area: int | None = None) -> tuple[float, Point2, int]:
        """Return how near to a point of `map` the robot may be, where, and in which area; infinity if nowhere.

        Lengths in metres; `area` leaves out all others.
        """
        rows, columns = np.nonzero(self.areas if area is None else self.areas == area)
        if not rows.size:
            return math.inf, place, 0
        u, v = self.grid.to_cells(place).tolist()
        away = np.hypot(columns + 0.5 - u, rows + 0.5 - v)
        best = int(away.argmin())
        x, y = self.grid.to_points((columns[best] + 0.5, rows[best] + 0.5)).tolist()
        return float(away[best]) * self.grid.resolution, (x, y), int(self.areas[rows[best], columns[best]])

    def bottleneck(self, one: Point2, other: Point2) -> tuple[float, Point2] | None:
        """Return the largest radius with which a robot comes from one point of an area to one of another [m], and the
        place in `map` through which a larger one does not fit; None if walls are between.

        The radius is exact to 2 % of that of this robot.
        """
        (column, row), (last_column, last_row) = np.floor(self.grid.to_cells([one, other])).astype(int).tolist()

        def ends(areas: Ints32) -> tuple[int, int]:
            return int(areas[row, column]), int(areas[last_row, last_column])

        low, high, split = 0.0, self.radius, self.areas
        if not _is_one(*ends(self.with_radius(low))):
            return None
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            areas = self.with_radius(middle)
            if _is_one(*ends(areas)):
                low = middle
            else:
                high, split = middle, areas
        first, second = (split == end for end in ends(split))
        gap, common = 1.0, first & second
        while not common.any():
            common = _grown(first, gap) & _grown(second, gap)
            gap *= 1.5
        x, y = self.grid.to_points(np.argwhere(common)[0, ::-1] + 0.5).tolist()
        return low, (x, y)

    def _block(self, blocked: Bools, thing: WorldShape, reach: float) -> None:
        """Block the cells whose middles are within `reach` [m] of a thing."""
        side = self.grid.resolution
        u, v = self.grid.to_cells((thing.pose.x, thing.pose.y)).tolist()
        cells = (thing.solid.reach + reach) / side
        low, left = max(0, math.floor(v - cells)), max(0, math.floor(u - cells))
        window = slice(low, max(low, math.ceil(v + cells))), slice(left, max(left, math.ceil(u + cells)))
        part = blocked[window]
        middles = np.stack(
            np.meshgrid(np.arange(part.shape[1]) + (left + 0.5), np.arange(part.shape[0]) + (low + 0.5)), -1
        )
        x, y = np.moveaxis(self.grid.to_points(middles), -1, 0)
        x, y = x - thing.pose.x, y - thing.pose.y
        match thing.solid:
            case WorldCylinder(radius=radius):
                away = np.hypot(x, y) - radius
            case WorldBox(size=(length, width, _)):
                cos, sin = math.cos(thing.pose.heading), math.sin(thing.pose.heading)
                along, aside = np.abs(x * cos + y * sin) - length / 2, np.abs(y * cos - x * sin) - width / 2
                away = np.hypot(np.maximum(along, 0), np.maximum(aside, 0))
            case WorldHull() as hull:
                cos, sin = math.cos(thing.pose.heading), math.sin(thing.pose.heading)
                away = outside_polygon(hull.footprint, np.stack((x * cos + y * sin, y * cos - x * sin), -1))
            case _:
                raise TypeError(f"'{thing.name}' is not convex")
        part |= away <= reach


def _is_one(area: int, other: int) -> bool:
    return area == other != 0


def _grown(cells: Bools, reach: float) -> Bools:
    """Return the cells with a middle that is at most so many cells away from that of one of some cells."""
    height = math.floor(reach)
    rows, columns = cells.shape
    counts = np.zeros((rows, columns + 1), np.int32)
    np.cumsum(cells, 1, out=counts[:, 1:])
    found = np.zeros_like(cells)
    across = np.arange(columns)
    for up in range(min(height, rows - 1) + 1):
        half = math.floor(math.sqrt(reach * reach - up * up))
        row = counts[:, np.minimum(across + half + 1, columns)] > counts[:, np.maximum(across - half, 0)]
        found[up:] |= row[: rows - up]
        found[: rows - up] |= row[up:]
    return found


def _labelled(free: Bools) -> Ints32:
    """Return the number of the area of each free cell, from 1 on, where eight cells are neighbours; 0 for others.

    Free cells in a row are one run. Runs that touch those of the next row get the lowest number of them, until all of
    an area have the same.
    """
    width = free.shape[1] + 2  # so that runs of different rows never touch
    edges = np.diff(np.pad(free, 1).astype(np.int8).ravel())
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    first = np.searchsorted(ends, begins + width)
    counts = np.searchsorted(begins, ends + width, "right") - first
    run = np.repeat(np.arange(begins.size), counts)
    below = np.arange(run.size) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(first, counts)
    lowest = np.arange(begins.size)
    while (lowest[run] != lowest[below]).any():
        one, other = lowest[run], lowest[below]
        np.minimum.at(lowest, np.maximum(one, other), np.minimum(one, other))
        while (lowest != lowest[lowest]).any():
            lowest = lowest[lowest]
    areas = np.zeros(free.shape, np.int32)
    areas[free] = np.repeat(lowest + 1, ends - begins)
    return areas
