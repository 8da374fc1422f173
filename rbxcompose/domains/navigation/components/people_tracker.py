"""Tracking people with a laser."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.domains.navigation.people import KnownWalls, PeopleTracks, sightings
from rbxcompose.domains.navigation.reports import PeopleConfig, TellsPeople
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_of
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.msgs.sensor_arrays import level_rays
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.sdk.bound import NewestMessage
from rbxcompose.sdk.ports import BULK


class PeopleTrackerConfig(PeopleConfig):
    """Which laser it watches, and whom it takes for a person."""

    scan: TopicName = "scan"
    """Topic of the laser."""
    frame: str = "laser_link"
    """The frame of the laser."""
    walls: sdk.Length = Field(0.15, ge=0)
    """What is so near to a wall of the map is nobody: the error of the map and of the robot's pose."""


@sdk.component("people_tracker")
class PeopleTracker(TellsPeople[PeopleTrackerConfig]):
    """Finds people in the scans of a laser, and tracks them: things as wide as an adult or as two legs which the map
    does not explain, and which move.

    `people` has all of them, with reliability 0.5 for what has not moved so far and may be furniture. Missions read of
    the nearest who has moved: `person_seen`, and `person_distance`, which is `farthest` without anybody.

    Example:
        people: {type: people_tracker, frame: laser_link, farthest: 5 m}
    """

    rate = 5.0
    map = sdk.In(OccupancyGrid, "map", qos="latched", limits=BULK, is_open=True, may_be_silent=True)

    @classmethod
    def ports(cls, config: PeopleTrackerConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those of its laser, and where that is."""
        return super().ports(config) | {
            "scan": sdk.In(LaserScan, config.scan).named("scan"),
            "laser": sdk.Looks(source=config.frame, target=config.stands_in).named("laser"),
        }

    @classmethod
    def capabilities(cls, config: PeopleTrackerConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it imports."""
        return (sdk.NeedsExtra(sdk.Setting("scipy"), sdk.Setting("navigation")),)

    def configure(self) -> None:
        """Know nobody yet."""
        self.tracks = PeopleTracks(self.config.forget)
        self.walls: KnownWalls | None = None
        self.scan = NewestMessage[LaserScan](self.config.frame, "scans are in '{}', and expected in '{}'")
        self.taken = -math.inf  # when a scan was taken last [s]

    def on_map(self, message: OccupancyGrid) -> None:
        """Take a map, which explains what is no person."""
        if self.config.stands_in == (message.header.frame_id or MAP_FRAME):
            self.walls = KnownWalls(grid_of(message), self.config.walls)

    def on_scan(self, message: LaserScan) -> None:
        """Take a scan, now or as soon as it is known from where it was taken."""
        self.scan.put(message)
        self.take_scan()

    def take_scan(self) -> None:
        """Take the newest scan, unless that has been done."""
        if (placed := self.scan.take(self.now, self.bound["laser"])) is None:
            return
        message, (at,) = placed
        self.taken = self.now
        most = min(self.config.farthest, message.range_max)
        found = sightings(*level_rays(at, message), most, self.walls)
        self.tracks.see(found, self.now)
        self.tell(self.tracks.people(self.now))

    def step(self, dt: float) -> None:
        """Publish what missions read."""
        self.take_scan()
        self.report(self.tracks.people(self.now), self.scan.problem, self.taken)
