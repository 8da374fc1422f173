"""What it costs to be at each place of a map: walls, what sensors see, and room around both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from rbxcompose.base.arrays import AnyArray, Array, ArrayLike, Bools, Bytes, Indices, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.contact import in_polygon, outside_polygon
from rbxcompose.domains.worlds.grid_map import SOLID, UNKNOWN, GridMap
from rbxcompose.domains.worlds.shapes import Point2, PolygonFootprint

LETHAL, INSCRIBED, DEAREST, NO_INFORMATION = 254, 253, 252, 255  # as in Nav2's costmaps
RECENT = 0.8  # [s]
NEAR = 2.0  # [m] from the sensor: what moves farther away concerns nobody
JITTER = 2  # [cells] by which marks of something that stands may change
LEAST = 0.02  # [m^2] of what moves
ROUNDING = 1e-4  # [m] of clearances
TURNED = 1000 * math.tau  # [rad] that no angle of a scan reaches
FAR = 1e6  # [cells] to an obstacle if there is none


@dataclass(frozen=True, slots=True)
class CostSettings:
    """How near to obstacles a robot may be; lengths in metres, all above zero."""

    radius: float = 0.2
    """Of the robot: its origin never comes so near to an obstacle."""
    inflation: float = 0.45
    """Up to here, places near to an obstacle are dearer."""
    decay: float = 6.0
    """How fast that falls off [1/m]."""
    unknown_is_free: bool = True
    """Whether ways may lead through what the map does not know."""
    outline: PolygonFootprint | None = None
    """Of a robot that is no circle; `radius` is then that of the circle which it covers."""

    @property
    def reach(self) -> float:
        """Return how far the robot extends [m]."""
        return self.radius if self.outline is None else self.outline.reach


@dataclass(frozen=True, slots=True)
class CostZone:
    """A part of the map, by the corners of a polygon in `map` [m]: a `share` of the speed, 0 to keep out."""

    name: str
    corners: tuple[Point2, ...]
    share: float = 0.0

    def cells(self, grid: GridMap) -> Bools:
        """Return which cells of a map have their middles in it."""
        rows, columns = grid.cells.shape
        middles = grid.to_points(np.stack(np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5), -1))
        return in_polygon(self.corners, middles[..., 0], middles[..., 1])


@dataclass(frozen=True, slots=True, eq=False)
class TracedScan:
    """What a scan says about the cells of a map."""

    rows: slice
    columns: slice
    passed: Bools
    """Which cells of these rows and columns rays pass."""
    ends: tuple[Indices, Indices]
    """Rows and columns of the cells in which rays end."""


def trace(
    grid: GridMap, sensor: Pose2, angles: ArrayLike, ranges: ArrayLike, most: float, behind: float = 0.1
) -> TracedScan | None:
    """Return what rays of a sensor at a pose in `map`, which end at `ranges` [m], say about cells up to `most` [m].

    An infinite range passes all up to there; ranges that are no numbers or not above zero count not. None if none
    counts, or an angle [rad] is not finite or more than a thousand turns. Rays end on faces of things, so what they end
    in is looked for a little `behind` [sides of a cell]: so much the noise of a laser may be.
    """
    angles, ranges = np.asarray(angles, float), np.asarray(ranges, float)
    counts = ranges > 0
    if not (most > 0 and counts.any() and (np.abs(angles) < TURNED).all()):
        return None
    if len(angles) > 1 and angles[0] > angles[-1]:
        angles, ranges, counts = angles[::-1], ranges[::-1], counts[::-1]
    side, shape = grid.resolution, grid.cells.shape
    column, row = grid.to_cells((sensor.x, sensor.y)).tolist()
    rows, columns = (
        slice(*part.indices(size)[:2])
        for part, size in zip((_window(row, most / side), _window(column, most / side)), shape, strict=True)
    )
    lengths = np.where(counts, np.minimum(ranges, most) - side, 0.0)
    heading = sensor.heading - grid.origin.heading
    corner = rows.start - row, columns.start - column
    window = max(0, rows.stop - rows.start), max(0, columns.stop - columns.start)
    hits = counts & (ranges <= most)
    along = np.stack((np.cos(angles[hits] + sensor.heading), np.sin(angles[hits] + sensor.heading)), -1)
    ends = grid.to_cells((sensor.x, sensor.y) + along * (ranges[hits] + behind * side)[:, None])
    places = np.floor(ends).astype(int)
    inside = ((places >= 0) & (places < shape[::-1])).all(-1)
    passed = _passed(window, corner, side, angles + heading, lengths)
    return TracedScan(rows, columns, passed, (places[inside, 1], places[inside, 0]))


class LayeredCosts:
    """Costs of a map in layers: the map itself, zones, and marks of sensors; with inflation around all of them.

    `values` (rows, columns) are 0 where nothing is near, 254 within obstacles, 253 where the robot would touch one, and
    255 where nothing is known. The cost at a distance d is 252 exp(-decay (d - radius)), as in Nav2's inflation layer
    (https://docs.nav2.org/configuration/packages/costmap-plugins/inflation.html).
    """

    def __init__(self, grid: GridMap, settings: CostSettings, zones: Sequence[CostZone] = ()) -> None:
        self.grid, self.settings = grid, settings
        self._walls = grid.cells >= SOLID
        self._zones: dict[str, Bools] = {}  # to keep out of
        self._unknown = grid.cells == UNKNOWN
        self.shares = np.ones(grid.cells.shape)
        """Of the speed, in each cell."""
        for zone in zones:
            inside = zone.cells(grid)
            if zone.share > 0:
                self.shares[inside] = np.minimum(self.shares[inside], zone.share)
            else:
                self._zones[zone.name] = inside | self._zones.get(zone.name, False)
        self._lasting: Bools = np.any([self._walls, *self._zones.values()], 0)
        self._marks: Bools = np.zeros(grid.cells.shape, bool)
        self._free = np.zeros(grid.cells.shape, bool)  # passed by a ray since it was marked
        self._past = [(self._marks, self._free)] * 2  # what they were one to two `RECENT` ago, and up to one
        self._kept = -math.inf  # [s] at which the latter was kept
        self.moving: Array = np.empty((0, 2))
        """Points (n, 2) of `map` [m] near to the sensor, at which it sees something where nothing was a second ago."""
        self.away: Array = np.zeros(grid.cells.shape)
        """How far the middle of each cell is from that of the nearest obstacle [m], exactly up to the inflation."""
        self.values: Bytes = np.zeros(grid.cells.shape, np.uint8)
        self._samples = _samples(settings.outline, grid.resolution)
        self._inflate(slice(None), slice(None))

    def set(self, settings: CostSettings) -> None:
        """Use other settings from now on."""
        self.settings, self._samples = settings, _samples(settings.outline, self.grid.resolution)
        self._inflate(slice(None), slice(None))

    def clear(self) -> None:
        """Forget what sensors have seen."""
        self._marks = np.zeros_like(self._marks)
        self._free = np.zeros_like(self._free)
        self._past, self.moving = [(self._marks, self._free)] * 2, np.empty((0, 2))
        self._inflate(slice(None), slice(None))

    def see(self, sensor: Pose2, angles: ArrayLike, ranges: ArrayLike, most: float, time: float = 0.0) -> bool:
        """Take a scan at a time [s] of a sensor at a pose in `map`.

        Rays at `angles` [rad] end at `ranges` [m]: what they end at, up to `most` [m], is marked, and what they pass is
        cleared. An infinite range passes all up to `most`; ranges that are no numbers or not above zero count not.
        Returns whether any counts; none does if an angle is not finite or more than a thousand turns.
        """
        scan = trace(self.grid, sensor, angles, ranges, most)
        if scan is None:
            return False
        side = self.grid.resolution
        rows, columns = scan.rows, scan.columns
        before = self._marks[rows, columns].copy()
        self._marks[rows, columns] &= ~scan.passed
        self._free[rows, columns] |= scan.passed
        self._marks[scan.ends] = True
        self._free[scan.ends] = False
        column, row = self.grid.to_cells((sensor.x, sensor.y)).tolist()
        self._find_moving(row, column, time)
        changed = np.argwhere(self._marks[rows, columns] != before)
        if changed.size:
            margin = math.ceil((self.settings.inflation + side) / side)
            (top, left), (bottom, right) = changed.min(0), changed.max(0) + 1
            self._inflate(
                slice(max(0, rows.start + int(top) - margin), rows.start + int(bottom) + margin),
                slice(max(0, columns.start + int(left) - margin), columns.start + int(right) + margin),
            )
        return True

    def _find_moving(self, row: float, column: float, time: float) -> None:
        """Compare the marks near to a sensor with the past: what it only sees now, because it moves, was not free."""
        from scipy.ndimage import binary_dilation

        if not 0 <= time - self._kept < RECENT:
            self._past, self._kept = [self._past[1], (self._marks.copy(), self._free.copy())], time
        reach = NEAR / self.grid.resolution
        near = _window(row, reach), _window(column, reach)
        marks, free = (cells[near] for cells in self._past[0])
        found = self._marks[near] & free
        if found.any():
            found &= ~binary_dilation(marks, iterations=JITTER)
        if found.sum() * self.grid.resolution**2 < LEAST:  # rays along the side of something that stands see it late
            found[:] = False
        self.moving = self.grid.to_points(np.argwhere(found)[:, ::-1] + (near[1].start + 0.5, near[0].start + 0.5))

    def value_at(self, x: float, y: float) -> int:
        """Return the cost at a point of `map` [m]; beside the map nothing is known."""
        return int(self._at(self.values, x, y, NO_INFORMATION))

    def is_wall(self, x: float, y: float) -> bool:
        """Return whether the map or a zone always keeps the robot from a point of `map` [m]."""
        return bool(self._at(self._lasting, x, y, False))

    def clearance(self, poses: Array) -> float:
        """Return how near to something the robot comes [m] at poses (n, 3) in `map` [m], [rad]; below 0 it touches it.

        Ways keep off further, by up to the side of a cell: who follows one may be a little off.
        """
        return self._clearance(poses, self.away)

    def comes_nearer(self, pose: Pose2, poses: Sequence[Pose2] | Array, least: float) -> bool:
        """Return whether less than `least` [m] is left to something at some poses, and less than at a pose before.

        So a robot may leave what it is too near to. Each zone counts by itself, as all things do: a robot within a zone
        must not touch a wall.
        """
        after = poses if isinstance(poses, np.ndarray) else rows_of(*poses)
        if self.clearance(after) >= least:
            return False
        before = rows_of(pose)
        return any(now < min(least, was - ROUNDING) for was, now in self._clearances(before, after).values())

    def zone_at(self, x: float, y: float) -> str:
        """Return the zone to keep out of that is nearest to a point of `map` [m]; nothing if something else is."""
        near = self._clearances(rows_of(Pose2(x, y)))
        return min(near, key=lambda name: near[name][0])

    def _clearances(self, *parts: Array) -> dict[str, list[float]]:
        """Return the clearances of some poses each from all things, which have no name, and from each zone to keep out
        of; large ones if they are farther away than the robot extends."""
        cells = self.grid.to_cells(np.concatenate(parts)[:, :2])
        cells = np.clip(cells, 0, np.array(self.values.shape[::-1]) - 1)
        reach = self.settings.reach / self.grid.resolution + 2
        low, high = np.floor(np.maximum(cells.min(0) - reach, 0)).astype(int), np.ceil(cells.max(0) + reach).astype(int)
        near = slice(low[1], high[1] + 1), slice(low[0], high[0] + 1)
        solid = {"": self._walls[near] | self._marks[near]} | {name: zone[near] for name, zone in self._zones.items()}
        return {
            name: [self._clearance(poses, distances(found) * self.grid.resolution, low) for poses in parts]
            for name, found in solid.items()
        }

    def _clearance(self, poses: Array, distances: Array, first: Indices | float = 0) -> float:
        """Return the clearance of poses, given how far [m] cells are from something: those from the `first` one on, at
        (column, row)."""
        from scipy.ndimage import map_coordinates

        if not len(poses):
            return math.inf
        x, y, heading = poses.T[:, :, None]
        (along, aside, within), cos, sin = self._samples.T, np.cos(heading), np.sin(heading)
        points = np.stack((x + cos * along - sin * aside, y + sin * along + cos * aside), -1)
        column, row = np.moveaxis(self.grid.to_cells(points) - first, -1, 0) - 0.5
        away = map_coordinates(distances, (row, column), order=1, mode="nearest")
        # An obstacle is a square around its middle; edges of a robot meet its corners more often than a rim does.
        kept = 0.5 * self.grid.resolution + self.settings.radius
        if self.settings.outline is not None:
            kept = math.sqrt(0.5) * self.grid.resolution
        return float((away - within).min()) - kept

    def clear_at(self, *poses: Pose2) -> float:
        """Return how near to something the robot comes at some poses [m]."""
        return self.clearance(rows_of(*poses))

    def room_at(self, points: Array) -> float:
        """Return the radius of the largest circle for which there is room at each of some points (n, 2) of `map` [m].

        Without obstacles up to the inflation, it is larger than that.
        """
        from scipy.ndimage import map_coordinates

        column, row = self.grid.to_cells(points).T - 0.5
        away = map_coordinates(self.away, (row, column), order=1, mode="nearest")
        return float(away.min()) - math.sqrt(0.5) * self.grid.resolution

    @property
    def solid(self) -> Bools:
        """Return which cells something is in."""
        return self._lasting | self._marks

    @property
    def has_room(self) -> bool:
        """Return whether the map and its zones leave room for the robot anywhere."""
        return float(distances(self._lasting).max() - 1) * self.grid.resolution > self.settings.radius

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """Return the row and the column of a point of `map` [m], which may be beside it."""
        column, row = np.floor(self.grid.to_cells((x, y))).astype(int).tolist()
        return row, column

    def share_at(self, x: float, y: float) -> float:
        """Return the share of the speed at a point of `map` [m]."""
        return float(self._at(self.shares, x, y, 1.0))

    def _at(self, table: AnyArray, x: float, y: float, beside: float) -> Any:
        """Return what a table has at a point of `map` [m]: for one point, faster than `look_up`."""
        row, column = self.cell_of(x, y)
        rows, columns = table.shape
        return table[row, column] if 0 <= row < rows and 0 <= column < columns else beside

    def _inflate(self, rows: slice, columns: slice) -> None:
        """Compute the costs of a part of the map again; what is around it counts, too."""
        settings, side = self.settings, self.grid.resolution
        margin = math.ceil(settings.inflation / side) + 1
        around = _wider(rows, margin, self.values.shape[0]), _wider(columns, margin, self.values.shape[1])
        solid = self._lasting[around] | self._marks[around]
        inner = tuple(
            slice(part.indices(size)[0] - wide.start, part.indices(size)[1] - wide.start)
            for part, wide, size in zip((rows, columns), around, self.values.shape, strict=True)
        )
        middles = distances(solid)[inner]
        self.away[rows, columns] = middles * side
        away = (middles - 1) * side  # from any place of a cell to the edge of an obstacle
        found = DEAREST * np.exp(-settings.decay * np.maximum(away - settings.radius, 0.0))
        found[away > settings.inflation] = 0.0
        found = np.where(away <= settings.radius, INSCRIBED, np.minimum(found, DEAREST))
        found[(found < INSCRIBED) & self._unknown[rows, columns] & ~self._marks[rows, columns]] = NO_INFORMATION
        found[solid[inner]] = LETHAL
        self.values[rows, columns] = found.astype(np.uint8)


def rows_of(*poses: Pose2) -> Array:
    """Return poses as an array (n, 3): [m], [m], [rad]."""
    return np.array([(at.x, at.y, at.heading) for at in poses]).reshape(-1, 3)


def distances(solid: Bools) -> Array:
    """Return how far the middle of each cell is from that of the nearest solid one [cells]."""
    from scipy.ndimage import distance_transform_edt

    return np.asarray(distance_transform_edt(~solid)) if solid.any() else np.full(solid.shape, FAR)


def _samples(outline: PolygonFootprint | None, side: float) -> Array:
    """Return circles (n, 3) which nearly cover a robot, in its frame: x, y and radius [m].

    Those of radius 0 are on its rim: what is outside is near to one of them. The others find what is inside.
    """
    if outline is None:
        return np.zeros((1, 3))
    corners = np.array((*outline.points, outline.points[0]))
    rim = [
        before + (after - before) * np.arange(count := math.ceil(2 * math.dist(before, after) / side))[:, None] / count
        for before, after in pairwise(corners)
    ]
    steps = np.arange(-outline.reach, outline.reach, side)
    places = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2)
    within = -outside_polygon(outline, places)
    inside = within > side / 2
    found = np.concatenate((*rim, places[inside]))
    return np.column_stack((found, np.concatenate((np.zeros(len(found) - inside.sum()), within[inside]))))


def _passed(shape: tuple[int, ...], corner: tuple[float, float], side: float, angles: Array, lengths: Array) -> Bools:
    """Return which cells have a middle that rays pass by less than half of the angle between two of them.

    `corner` is where the first cell begins, seen from the sensor, as (row, column) [cells]; `lengths` are in metres.
    """
    y = (corner[0] + 0.5 + np.arange(shape[0]))[:, None] * side
    x = (corner[1] + 0.5 + np.arange(shape[1])) * side
    step = (angles[-1] - angles[0]) / max(1, len(angles) - 1) or math.tau
    turned = np.remainder(np.arctan2(y, x) - angles[0] + step / 2, math.tau)
    ray = (turned / step).astype(int)
    is_seen = ray < len(angles)
    return np.asarray(is_seen & (np.hypot(x, y) < lengths[np.where(is_seen, ray, 0)]))


def _window(middle: float, reach: float) -> slice:
    return slice(max(0, math.floor(middle - reach)), max(0, math.ceil(middle + reach)))


def _wider(part: slice, margin: int, size: int) -> slice:
    start, stop, _ = part.indices(size)
    return slice(max(0, start - margin), min(size, stop + margin))
