"""Where the robot is in its map, by its laser."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.levels import Level
from rbxcompose.domains.navigation.localisation import LocalisationSettings, ParticleFilter
from rbxcompose.domains.navigation.localiser import BASE, BEGAN_AGAIN, ODOM, RESTARTED, Localiser, RecallPlace
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_of
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.msgs.poses import message_of
from rbxcompose.msgs.sensor_arrays import level_rays, rays_of
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.std_srvs import Empty
from rbxcompose.sdk.bound import NewestMessage
from rbxcompose.sdk.ports import BULK

# Share of a scan that the map explains, and a standard deviation [m], by which a doubtful place is right. In the house
# of the examples, a map explains at least 54 % of twenty scans in a row, or 42 % beside two people; seen from a wrong
# place in nine of ten cases less than 50 %.
FOUND, SURE = 0.5, 0.3
LATELY = 0.05  # share of the newest scan in the mean of the last ones


class LocalisationConfig(sdk.Config):
    """What it starts from, and how many places it considers."""

    scan: str = "scan"
    """Topic of the laser."""
    scan_frame: str = "laser_link"
    """The frame of the laser."""
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the robot probably is at first: x, y [m] and heading [rad] in `map`."""
    spread: Annotated[sdk.Length, sdk.Live()] = Field(0.2, ge=0)
    """Standard deviation of both coordinates of a start, also in another map."""
    turn_spread: Annotated[sdk.Angle, sdk.Live()] = Field(math.radians(10), ge=0)
    """Standard deviation of its heading."""
    anywhere: bool = False
    """Whether it may be anywhere at first."""
    least: Annotated[int, Field(ge=10, le=100_000), sdk.Live()] = 500
    """Particles at least."""
    most: Annotated[int, Field(ge=10, le=100_000), sdk.Live()] = 2000
    """Particles at most."""
    seed: int = 1
    """Of the random numbers."""


@sdk.component("particle_localisation")
class ParticleLocalisation(Localiser[LocalisationConfig]):
    """Finds the robot in its map by a laser, with a particle filter, and publishes where `odom` is in `map`.

    Example:
        localisation: {type: particle_localisation}
    """

    made_by = "The section `navigation` runs it."
    rate = 10.0
    cloud = sdk.Out(geometry.PoseArray, "particle_cloud")
    map = sdk.In(OccupancyGrid, "map", qos="latched", limits=BULK)
    initialpose = sdk.In(
        geometry.PoseWithCovarianceStamped, "initialpose", qos="event", is_open=True, may_be_silent=True
    )
    anywhere = sdk.Serves(Empty, "reinitialize_global_localization", skill=None)
    odometry = sdk.Looks(source=BASE, target=ODOM)

    @classmethod
    def ports(cls, config: LocalisationConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those of its laser."""
        return super().ports(config) | {
            "scan": sdk.In(LaserScan, config.scan).named("scan"),
            "laser": sdk.Looks(source=config.scan_frame, target=BASE).named("laser"),
        }

    @classmethod
    def capabilities(cls, config: LocalisationConfig) -> tuple[sdk.Capability, ...]:
        """Declare the frame that it places, and what it imports."""
        extra = sdk.NeedsExtra(sdk.Setting("scipy"), sdk.Setting("navigation"))
        return (*super().capabilities(config), extra)

    def configure(self) -> None:
        """Know no map yet."""
        super().configure()
        self.filter: ParticleFilter | None = None
        self.scan = NewestMessage[LaserScan]()
        self.explains = math.nan  # share of the last scans that the map explains
        self.correction: Pose2 | None = None  # of `odom` in `map`, as soon as map and odometry are known

    def activate(self) -> None:
        """Watch how well the map explains what the laser sees."""
        self.add_diagnostic("scan", self.explained)

    def reconfigure(self, old: LocalisationConfig) -> None:
        """Draw another number of particles from the next scan on."""
        if self.config.least > self.config.most:
            raise sdk.Refused("'least' is not above 'most'")
        if self.filter is not None:
            self.filter.settings = filter_settings(self.config)

    def explained(self, now: float) -> sdk.TaskStatus:
        """Report how much of the newest scan the map explains."""
        if self.filter is None:
            return sdk.TaskStatus(Level.WARN, "there is no map")
        if self.doubt:
            help_text = "give a pose on 'initialpose', or let it drive by hand until it has found itself"
            return sdk.TaskStatus(Level.ERROR, f"{self.doubt}, so nothing drives: {help_text}")
        if math.isnan(self.explains):
            return sdk.TaskStatus(Level.OK, "no scan has been compared with the map yet")
        share = f"the map explains {self.explains:.0%} of what the laser sees"
        if self.explains >= FOUND:
            return sdk.TaskStatus(Level.OK, share)
        return sdk.TaskStatus(Level.WARN, f"{share}: either much is not on the map, or the robot is elsewhere on it")

    def on_map(self, message: OccupancyGrid) -> None:
        """Begin in a new map: at the start, or where the robot was believed to be."""
        config, before = self.config, self.filter
        self.filter = ParticleFilter(grid_of(message), filter_settings(config), config.seed)
        if before is not None:
            self.begin(before.pose, config.spread, config.turn_spread)
        elif self.is_new and not config.anywhere:
            self.begin(Pose2(*config.start), config.spread, config.turn_spread)

    def on_initialpose(self, message: geometry.PoseWithCovarianceStamped) -> None:
        """Begin again at a pose that somebody pointed at in a viewer."""
        if (given := self.given(message)) and self.begin(*given):
            self.doubt, self.recalled = "", None
            self.keep(None)  # until the next scan

    def on_anywhere(self, request: Empty.Request) -> Empty.Response:
        """Begin again with no idea."""
        if self.filter is not None:
            self.filter.start_anywhere()
            self.explains = math.nan
            self.doubt = self.doubt and RESTARTED  # scans from one place do not decide among all
        return Empty.Response()

    def begin(self, pose: Pose2, spread: float, turn_spread: float, *others: Pose2) -> bool:
        """Begin around a pose, or others; return whether it is one of the map."""
        if self.filter is None:
            return False
        try:
            self.filter.start(pose, spread, turn_spread, *others)
        except ValueError as error:
            self.warn(str(error))
            return False
        self.explains = math.nan
        return True

    def go_on_from(self, since: RecallPlace, stayed: Pose2 | None) -> str:
        """Begin where the robot was, moved since; where it may have stayed, the next scan decides."""
        if self.filter is not None:
            self.filter.move(since.odometry)
        if stayed is None:
            return "" if self.begin(since.pose, since.spread, since.turn_spread) else RESTARTED
        self.scan = NewestMessage()  # it may be from before
        self.begin(stayed, self.config.spread, self.config.turn_spread, since.pose)
        return BEGAN_AGAIN

    def on_scan(self, message: LaserScan) -> None:
        """Weigh a scan, now or as soon as it is known from where it was taken."""
        self.scan.put(message)
        self.take_scan()

    def take_scan(self) -> None:
        """Weigh the newest scan, unless that has been done."""
        if self.filter is None:
            return
        if (odometry := self.odometry.now()) is not None:
            self.look_back(odometry)
            if not self.filter.has_moved:
                self.filter.move(odometry)
        if (placed := self.scan.take(self.now, self.bound["laser"], self.odometry)) is None:
            return  # diagnostics of transforms say so
        message, (laser, base) = placed
        self.filter.move(base.to_pose2())
        sensor, angles, ranges = level_rays(laser, message)
        ranges = np.where(rays_of(message)[1] <= message.range_max, ranges, math.inf)
        is_weighed = self.filter.see(sensor, angles, ranges, anew=self.doubt == BEGAN_AGAIN)
        quality, covariance = self.filter.quality, self.filter.covariance
        if not math.isnan(quality):
            self.explains = quality if math.isnan(self.explains) else self.explains + LATELY * (quality - self.explains)
        if quality >= FOUND and math.sqrt(covariance[[0, 1], [0, 1]].max()) <= SURE:
            self.doubt = ""
        if is_weighed:
            self.tell(self.filter, message.header)
        if not self.doubt:
            self.remember(self.filter.pose, base.to_pose2(), covariance, self.time_of(message.header.stamp))

    def step(self, dt: float) -> None:
        """Publish where `odom` is in `map`, unless that is in doubt."""
        self.take_scan()
        if self.filter is not None and self.filter.has_moved:
            self.correction = self.filter.correction
        if self.correction is not None and not self.doubt:
            self.place(self.correction)

    def tell(self, found: ParticleFilter, of: Header) -> None:
        """Publish the pose, unless it is in doubt, and for viewers the particles."""
        if not self.doubt:
            self.publish_pose(found.pose, found.covariance, of.stamp)
        if self.cloud.is_wanted:
            header = Header(stamp=of.stamp, frame_id=MAP_FRAME)
            self.cloud(geometry.PoseArray(header, tuple(message_of(Pose2(*one)) for one in found.poses.tolist())))


def filter_settings(config: LocalisationConfig) -> LocalisationSettings:
    """Return the settings of the filter."""
    return LocalisationSettings(least=min(config.least, config.most), most=config.most)
