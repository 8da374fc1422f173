"""How far rays of a sensor go until they hit a map or a shape."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from rbxcompose.base.arrays import Array, ArrayLike, Bools, np
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap
from rbxcompose.domains.worlds.shapes import Point2, WorldBox, WorldCylinder, WorldHull, WorldShape, convex_hull

TINY = 1e-12  # stands for 0 in a direction
AT_ONCE = 1 << 14  # crossings that are examined together: so many stay in the cache
LEAST = 16  # of a ray


class _Axis(NamedTuple):
    """Of rays along one axis of a map: where they begin, their directions, and how many cells it has."""

    at: float
    direction: Array
    size: int


class Rays:
    """Casts rays in a map, of which it keeps two copies, each of one byte per cell.

    A ray enters a cell through one of its sides. So all its crossings with lines between columns are examined for an
    occupied cell behind them, and then those with lines between rows: exact, without samples (J. Amanatides and A. Woo,
    A Fast Voxel Traversal Algorithm for Ray Tracing, 1987, for all rays at once).
    """

    def __init__(self, grid: GridMap) -> None:
        self.grid = grid
        # Free cells all around take what rounding puts beside the map.
        self._by_row = np.pad(grid.cells >= SOLID, 1)
        self._by_column = np.ascontiguousarray(self._by_row.T)

    def cast(
        self, origin: Point2, angles: ArrayLike, most: float, shapes: Sequence[WorldShape] = (), z: float = 0.0
    ) -> Array:
        """Return how far rays go [m] from `origin` in `map` at `angles` (n,) [rad]; inf for `most` [m] and beyond.

        Occupied cells are solid squares of any height; what is unknown, or beside the map, is free. Shapes count if
        they are at the height `z` [m]. A ray that begins inside something has length 0.
        """
        directions = np.asarray(angles, float)
        found = self._to_map(origin, directions, most)
        near = [
            part
            for shape in shapes
            for part in shape.convex
            if part.is_between(z, z)
            and math.hypot(shape.pose.x - origin[0], shape.pose.y - origin[1]) - shape.solid.reach <= most
        ]
        if near:
            np.minimum(found, _to_shapes(near, origin, directions, z), out=found)
        found[found >= most] = math.inf
        return found

    def _to_map(self, origin: Point2, angles: Array, most: float) -> Array:
        """Return the distances to occupied cells [m], or inf."""
        if self.grid.occupied_at(origin):
            return np.zeros(angles.shape)
        u, v = self.grid.to_cells(origin).tolist()
        rows, columns = self.grid.cells.shape
        turned = angles - self.grid.origin.heading
        across, upwards = _Axis(u, np.cos(turned), columns), _Axis(v, np.sin(turned), rows)
        limit = np.full(angles.shape, most / self.grid.resolution)
        hit = _to_side(self._by_column, across, upwards, limit)
        hit = np.minimum(hit, _to_side(self._by_row, upwards, across, np.minimum(limit, hit)))
        return np.asarray(hit * self.grid.resolution)


def _to_side(solid: Bools, along: _Axis, other: _Axis, limit: Array) -> Array:
    """Return the distances until rays enter an occupied cell through a side that is normal to an axis, or inf [cells].

    `solid` (cells along the axis, cells along the other one) has a margin of one cell.
    """
    forwards = along.direction > 0
    step = 1.0 / np.maximum(np.abs(along.direction), TINY)
    line = math.floor(along.at) + forwards  # the first line that a ray may cross, from which all are counted
    first = np.abs(line - along.at) * step
    enters, leaves = _slab(other.at - other.size / 2, other.direction, other.size / 2)
    begin = np.maximum(np.where(forwards, -line, line - along.size), np.ceil((enters - first) / step))
    begin = np.maximum(begin, 0.0)
    last = np.floor((np.minimum(leaves, limit) - first) / step)
    count = np.minimum(np.where(forwards, along.size - line, line), last + 1) - begin
    # The number of the cell in memory grows by the same amount from line to line, and its fraction is the place
    # between two lines of the other axis.
    stride = other.size + 2
    growth = np.where(forwards, stride, -stride) + step * other.direction
    start = (np.where(forwards, line, line - 1) + 1) * stride + 1 + other.at + first * other.direction + begin * growth
    hit = np.full(step.shape, math.inf)
    rays = np.flatnonzero(count > 0)
    done = 0
    while rays.size:
        block = max(LEAST, AT_ONCE // rays.size)
        place = np.multiply.outer(growth[rays], np.arange(done, done + block, dtype=float))
        place += start[rays, None]
        behind = solid.take(place.astype(np.intp), mode="clip")
        goes_on = count[rays] > done + block
        if behind.any():
            nearest = behind.argmax(1)
            found = behind[np.arange(rays.size), nearest] & (done + nearest < count[rays])
            good = rays[found]
            hit[good] = first[good] + (begin[good] + done + nearest[found]) * step[good]
            goes_on &= ~found
        rays = rays[goes_on]
        done += block
    return hit


def _to_shapes(shapes: Sequence[WorldShape], origin: Point2, angles: Array, z: float) -> Array:
    """Return the distances to the nearest of some convex shapes [m] at a height `z` [m], or inf."""
    boxes: list[tuple[float, ...]] = []
    cylinders: list[tuple[float, ...]] = []
    nearest = np.full(angles.shape, math.inf)
    for shape in shapes:
        x, y = origin[0] - shape.pose.x, origin[1] - shape.pose.y
        match shape.solid:
            case WorldBox(size=size):
                boxes.append((x, y, shape.pose.heading, size[0] / 2, size[1] / 2))
            case WorldCylinder(radius=radius):
                cylinders.append((x, y, radius))
            case WorldHull() as hull:
                turned = angles - shape.pose.heading
                at = _turned(x, y, -shape.pose.heading)
                np.minimum(nearest, _to_polygon(section(hull, round(z - shape.z, 4)), at, turned), out=nearest)
    if boxes:
        x, y, heading, half_length, half_width = np.array(boxes).T[:, :, None]
        cos, sin = np.cos(heading), np.sin(heading)
        across, up = np.cos(angles), np.sin(angles)
        (x0, x1) = _slab(cos * x + sin * y, across * cos + up * sin, half_length)
        (y0, y1) = _slab(cos * y - sin * x, up * cos - across * sin, half_width)
        np.minimum(nearest, _nearest(np.maximum(x0, y0), np.minimum(x1, y1)), out=nearest)
    if cylinders:
        x, y, radius = np.array(cylinders).T[:, :, None]
        dx, dy = np.cos(angles), np.sin(angles)
        middle, aside = -(x * dx + y * dy), x * dy - y * dx
        half = np.sqrt(np.maximum(radius**2 - aside**2, 0.0))
        leaves = np.where(np.abs(aside) <= radius, middle + half, -math.inf)
        np.minimum(nearest, _nearest(middle - half, leaves), out=nearest)
    return nearest


@lru_cache(maxsize=512)
def section(hull: WorldHull, z: float) -> tuple[Point2, ...]:
    """Return the corners of the cut through a hull at a height [m], which turn left; fewer than three if it is none."""
    points = [(x, y) for x, y, height in hull.corners if height == z]
    for triangle in hull.triangles:
        corners = [hull.corners[index] for index in triangle]
        for (ax, ay, az), (bx, by, bz) in zip(corners, (*corners[1:], corners[0]), strict=True):
            if (az < z) != (bz < z) and bz != az:
                part = (z - az) / (bz - az)
                points.append((ax + part * (bx - ax), ay + part * (by - ay)))
    return convex_hull(points)


def _turned(x: float, y: float, angle: float) -> Point2:
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


def _to_polygon(corners: Sequence[Point2], origin: Point2, angles: Array) -> Array:
    """Return how far rays go until they are in a convex polygon whose corners turn left [m], or inf."""
    if len(corners) < 3:
        return np.full(angles.shape, math.inf)
    begin = np.array(corners)
    along = np.roll(begin, -1, 0) - begin
    inwards = np.stack((-along[:, 1], along[:, 0]), -1)
    above = ((np.array(origin) - begin) * inwards).sum(1)[:, None]  # of each edge; inside of it, if not below 0
    rising = inwards @ np.stack((np.cos(angles), np.sin(angles)))
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -above / rising
    enters = np.where(rising > 0, crossing, np.where((rising == 0) & (above < 0), math.inf, -math.inf)).max(0)
    leaves = np.where(rising < 0, crossing, math.inf).min(0)
    return np.asarray(np.where((enters <= leaves) & (leaves >= 0), np.maximum(enters, 0.0), math.inf))


def _nearest(enters: Array, leaves: Array) -> Array:
    """Return where rays first enter one of some shapes (shapes, rays), or inf: 0 if they begin inside."""
    return np.asarray(np.where((enters <= leaves) & (leaves >= 0), np.maximum(enters, 0.0), math.inf).min(0))


def _slab(at: float | Array, direction: Array, half: float | Array) -> tuple[Array, Array]:
    """Return the distances at which rays enter and leave what is between -half and half."""
    safe = np.where(np.abs(direction) < TINY, TINY, direction)
    low, high = (-half - at) / safe, (half - at) / safe
    return np.minimum(low, high), np.maximum(low, high)
