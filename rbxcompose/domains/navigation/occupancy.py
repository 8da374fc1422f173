"""Maps from scans at known poses: a grid of log odds, after S. Thrun, W. Burgard and D. Fox, Probabilistic Robotics
(2005), chapter 9."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.domains.navigation.costs import trace
from rbxcompose.domains.worlds.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap

GROWTH = 64  # cells by which a map grows, so that it does not with each scan
MOST_CELLS = 25_000_000  # of a map: 1.25 km^2 with a side of 5 cm
HIT, PASSED = 0.85, -0.4  # log odds of one scan: of 70 % and 40 %, as in Cartographer and OctoMap
BEHIND = 0.5  # sides of a cell behind a face in which what has it is marked: its middle
SURE = 4.0  # log odds to which a cell goes at most, so that it may change again: 98 %
IS_OCCUPIED, IS_FREE = math.log(0.65 / 0.35), math.log(0.196 / 0.804)  # the thresholds of map_saver

LogOdds = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class MappingSettings:
    """How a map is made; all above zero."""

    resolution: float = 0.05
    """Side of a cell [m]."""
    farthest: float = 8.0
    """Up to here, rays count [m]."""
    way: float = 0.1
    """How far the sensor moves before the next scan counts [m]: from one place, all scans have the same errors."""
    turn: float = 0.1
    """How far it turns before that [rad]."""


class OccupancyMapper:
    """A map that grows with what a sensor sees from poses that are known."""

    def __init__(self, settings: MappingSettings) -> None:
        self.settings = settings
        self._frame: GridMap | None = None  # where its cells are
        self._odds: LogOdds = np.zeros((1, 1), np.float32)
        self._last: Pose2 | None = None  # of the sensor at the last scan that counted

    @property
    def grid(self) -> GridMap | None:
        """Return the map so far: cells are free, occupied or unknown; None if all are unknown."""
        if self._frame is None:
            return None
        cells = np.full(self._odds.shape, UNKNOWN, np.int8)
        cells[self._odds < IS_FREE] = FREE
        cells[self._odds > IS_OCCUPIED] = OCCUPIED
        if not (is_known := cells != UNKNOWN).any():
            return None
        (top, bottom), (left, right) = (np.flatnonzero(is_known.any(axis))[[0, -1]].tolist() for axis in (1, 0))
        x, y = self._frame.to_points((left, top)).tolist()
        return GridMap(cells[top : bottom + 1, left : right + 1], self._frame.resolution, Pose2(x, y))

    def see(self, sensor: Pose2, angles: ArrayLike, ranges: ArrayLike, most: float = math.inf) -> bool:
        """Take a scan of a sensor at a pose in `map`: rays at `angles` (n,) [rad] end at `ranges` (n,) [m].

        An infinite range passes all up to `farthest`, or up to `most` [m] that the sensor sees. Returns whether the
        scan counts: none does before the sensor has moved on, or if it says nothing.

        Raises:
            ValueError: if the map would become too large; it stays as it is.
        """
        settings, last = self.settings, self._last
        turned = wrap_angle(last.heading - sensor.heading) if last is not None else math.inf
        if last is not None and last.distance(sensor) < settings.way and abs(turned) < settings.turn:
            return False
        frame, odds = self._around(sensor)
        scan = trace(frame, sensor, angles, ranges, min(settings.farthest, most), BEHIND)
        if scan is None:
            return False
        self._frame, self._odds, self._last = frame, odds, sensor
        change = np.zeros(scan.passed.shape, np.float32)
        change[scan.passed] = PASSED
        rows, columns = scan.ends
        change[rows - scan.rows.start, columns - scan.columns.start] = HIT
        part = self._odds[scan.rows, scan.columns]
        np.clip(part + change, -SURE, SURE, out=part)
        return True

    def _around(self, sensor: Pose2) -> tuple[GridMap, LogOdds]:
        """Return the map with enough cells for all that a sensor can see."""
        odds, side = self._odds, self.settings.resolution
        corner = Pose2(*(side * math.floor(place / side) for place in (sensor.x, sensor.y)))
        frame = self._frame or GridMap(np.empty((1, 1), np.int8), side, corner)
        column, row = frame.to_cells((sensor.x, sensor.y)).tolist()
        reach = self.settings.farthest / side + 1
        more = []
        for at, size in zip((row, column), odds.shape, strict=True):
            low, high = max(0.0, reach - at), max(0.0, at + reach - size)
            more.append(tuple(GROWTH * math.ceil(cells / GROWTH) for cells in (low, high)))
        if not any(map(any, more)):
            return frame, odds
        rows, columns = (size + sum(pair) for size, pair in zip(odds.shape, more, strict=True))
        if rows * columns > MOST_CELLS:
            raise ValueError(f"the map would have {columns} x {rows} cells")
        x, y = frame.to_points((-more[1][0], -more[0][0])).tolist()
        grown = GridMap(np.empty((rows, columns), np.int8), side, Pose2(x, y))
        return grown, np.pad(odds, more)
