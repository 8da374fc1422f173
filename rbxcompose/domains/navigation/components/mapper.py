"""A map of what a laser sees from known poses: a grid of log odds, after S. Thrun, W. Burgard and D. Fox, Probabilistic
Robotics (2005), chapter 9."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import ArrayLike, Singles, np
from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.base.levels import Level
from rbxcompose.domains.navigation.costs import trace
from rbxcompose.domains.worlds.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_message
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.msgs.sensor_arrays import level_rays
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.sdk.bound import NewestMessage

SHOWN = 2.0  # [s] between two maps
GROWTH = 64  # cells by which a map grows, so that it does not with each scan
MOST_CELLS = 25_000_000  # of a map: 1.25 km^2 with a side of 5 cm
HIT, PASSED = 0.85, -0.4  # log odds of one scan: of 70 % and 40 %, as in Cartographer and OctoMap
BEHIND = 0.5  # sides of a cell behind a face in which what has it is marked: its middle
SURE = 4.0  # log odds to which a cell goes at most, so that it may change again: 98 %
IS_OCCUPIED, IS_FREE = math.log(0.65 / 0.35), math.log(0.196 / 0.804)  # the thresholds of map_saver
WAY, TURNED = 0.1, 0.1  # [m], [rad] by which a sensor moves before the next scan counts: scans of one place err alike


class MapperConfig(sdk.Config):
    """What is mapped, and how finely."""

    scan: str = "scan"
    """Topic of the laser."""
    frame: str = "laser_link"
    """The frame of the laser."""
    topic: str = "mapped"
    """Topic of the map; `map` if no other map is there, so that navigation takes it."""
    resolution: sdk.Length = Field(0.05, ge=0.005, le=1)
    """Side of a cell."""
    farthest: sdk.Length = Field(8.0, gt=0, le=100)
    """Up to here, rays count."""


class OccupancyMapper:
    """A map that grows with what a sensor sees from poses that are known."""

    def __init__(self, resolution: float = 0.05, farthest: float = 8.0) -> None:
        """Take the side of a cell [m], and up to where rays count [m]."""
        self._resolution, self._farthest = resolution, farthest
        self._frame: GridMap | None = None  # where its cells are
        self._odds: Singles = np.zeros((1, 1), np.float32)
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
        last = self._last
        turned = wrap_angle(last.heading - sensor.heading) if last is not None else math.inf
        if last is not None and last.distance(sensor) < WAY and abs(turned) < TURNED:
            return False
        frame, odds = self._around(sensor)
        scan = trace(frame, sensor, angles, ranges, min(self._farthest, most), BEHIND)
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

    def _around(self, sensor: Pose2) -> tuple[GridMap, Singles]:
        """Return the map with enough cells for all that a sensor can see."""
        odds, side = self._odds, self._resolution
        corner = Pose2(*(side * math.floor(place / side) for place in (sensor.x, sensor.y)))
        frame = self._frame or GridMap(np.empty((1, 1), np.int8), side, corner)
        column, row = frame.to_cells((sensor.x, sensor.y)).tolist()
        reach = self._farthest / side + 1
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


@sdk.component("mapper")
class Mapper(sdk.Component[MapperConfig]):
    """Makes a map of what a laser sees, from the poses that the robot is known to have; `map save` writes it.

    Example:
        mapper: {type: mapper, frame: base_link}
    """

    rate = 5.0
    clear = sdk.Serves(Trigger, "clear_map", skill=None)

    @classmethod
    def ports(cls, config: MapperConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those of its laser and its map."""
        return super().ports(config) | {
            "map": sdk.Out(OccupancyGrid, config.topic, qos="latched").named("map"),
            "scan": sdk.In(LaserScan, config.scan).named("scan"),
            "laser": sdk.Looks(source=config.frame, target=MAP_FRAME).named("laser"),
        }

    def configure(self) -> None:
        """Know nothing yet."""
        self.mapper = OccupancyMapper(self.config.resolution, self.config.farthest)
        self.scan = NewestMessage[LaserScan]()
        self.trouble = ""
        self.changed, self.shown = False, 0.0  # since the last map; [s] at which that was

    def activate(self) -> None:
        """Watch whether the map grows."""
        self.add_diagnostic("map", self.grown)

    def grown(self, now: float) -> sdk.TaskStatus:
        """Report how large the map is."""
        if self.trouble:
            return sdk.TaskStatus(Level.ERROR, self.trouble)
        if (grid := self.mapper.grid) is None:
            return sdk.TaskStatus(Level.WARN, "nothing has been seen")
        rows, columns = grid.cells.shape
        return sdk.TaskStatus(Level.OK, f"{columns} x {rows} cells")

    def on_clear(self, request: Trigger.Request) -> Trigger.Response:
        """Begin again with an empty map."""
        self.configure()
        return Trigger.Response(success=True)

    def on_scan(self, message: LaserScan) -> None:
        """Take a scan as soon as it is known from where it was taken."""
        self.scan.put(message)
        self.take_scan()

    def take_scan(self) -> None:
        """Take the newest scan, unless that has been done."""
        if (placed := self.scan.take(self.now, self.bound["laser"])) is None:
            return  # diagnostics of transforms say so
        message, (at,) = placed
        try:
            self.changed |= self.mapper.see(*level_rays(at, message), message.range_max)
            self.trouble = ""
        except ValueError as error:
            if not self.trouble:
                self.warn(str(error))
            self.trouble = str(error)

    def step(self, dt: float) -> None:
        """Publish the map, now and then."""
        self.take_scan()
        if self.changed and self.now - self.shown >= SHOWN and (grid := self.mapper.grid) is not None:
            self.changed, self.shown = False, self.now
            self.bound["map"](grid_message(grid, Header(stamp=to_time(self.stamp), frame_id=MAP_FRAME)))
