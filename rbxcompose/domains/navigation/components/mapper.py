"""A map of what a laser sees."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.levels import Level
from rbxcompose.domains.navigation.occupancy import MappingSettings, OccupancyMapper
from rbxcompose.domains.worlds.poses import NewestMessage, rays_of
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_message
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.std_srvs import Trigger

SHOWN = 2.0  # [s] between two maps


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
        self.mapper = OccupancyMapper(MappingSettings(self.config.resolution, self.config.farthest))
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
            self.changed |= self.mapper.see(at.to_pose2(), *rays_of(message), message.range_max)
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
