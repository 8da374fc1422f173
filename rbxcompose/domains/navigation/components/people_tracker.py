"""Tracking people with a laser."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.levels import Level
from rbxcompose.domains.navigation.companion import SURE
from rbxcompose.domains.navigation.people import KnownWalls, PeopleTracks, TrackedPerson, sightings
from rbxcompose.domains.worlds.poses import message_of, rays_of
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_of
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, Vector3
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.msgs.people_msgs import People, Person
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Bool, ColorRGBA, Float32, Header
from rbxcompose.msgs.visualization_msgs import Marker, MarkerArray
from rbxcompose.sdk.ports import BULK

RADIUS, SIDES = 0.25, 16  # [m] and corners of the circle that stands for a person
LINE, TEXT = 0.04, 0.25  # [m] widths of lines and heights of texts
BLIND = 2.0  # [s] without a scan that can be used
SURE_COLOUR, UNSURE_COLOUR = ColorRGBA(r=0.1, g=0.45, b=0.9, a=1.0), ColorRGBA(r=0.5, g=0.5, b=0.5, a=1.0)


class PeopleTrackerConfig(sdk.Config):
    """Which laser it watches, and whom it takes for a person."""

    scan: TopicName = "scan"
    """Topic of the laser."""
    frame: str = "laser_link"
    """The frame of the laser."""
    stands_in: str = Field(MAP_FRAME, min_length=1)
    """The frame in which people are: `map`, or `odom` for a robot without a map."""
    farthest: sdk.Length = Field(6.0, gt=0)
    """Who is farther away is not tracked."""
    walls: sdk.Length = Field(0.15, ge=0)
    """What is so near to a wall of the map is nobody: the error of the map and of the robot's pose."""
    forget: sdk.Time = Field(2.0, gt=0)
    """Who was hidden for longer is somebody else."""


@sdk.component("people_tracker")
class PeopleTracker(sdk.Component[PeopleTrackerConfig]):
    """Finds people in the scans of a laser, and tracks them: things as wide as an adult or as two legs which the map
    does not explain, and which move.

    `people` has all of them, with reliability 0.5 for what has not moved so far and may be furniture. Missions read of
    the nearest who has moved: `person_seen`, and `person_distance`, which is `farthest` without anybody.

    Example:
        people: {type: people_tracker, frame: laser_link, farthest: 5 m}
    """

    rate = 5.0
    people = sdk.Out(People, "people")
    markers = sdk.Out(MarkerArray, "people_markers")
    person = sdk.Out(PoseStamped, "person")
    distance = sdk.Out(Float32, "person_distance", unit="m")
    seen = sdk.Out(Bool, "person_seen")
    map = sdk.In(OccupancyGrid, "map", qos="latched", limits=BULK, is_open=True, may_be_silent=True)

    @classmethod
    def ports(cls, config: PeopleTrackerConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those of its laser, and where it and the robot are."""
        return super().ports(config) | {
            "scan": sdk.In(LaserScan, config.scan).named("scan"),
            "laser": sdk.Looks(source=config.frame, target=config.stands_in).named("laser"),
            "base": sdk.Looks(source="base_footprint", target=config.stands_in).named("base"),
        }

    @classmethod
    def capabilities(cls, config: PeopleTrackerConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it imports."""
        return (sdk.NeedsExtra(sdk.Setting("scipy"), sdk.Setting("navigation")),)

    def configure(self) -> None:
        """Know nobody yet."""
        self.tracks = PeopleTracks(self.config.forget)
        self.walls: KnownWalls | None = None
        self.newest: LaserScan | None = None  # that is not taken yet
        self.problem = ""
        self.taken = -math.inf  # when a scan was taken last [s]

    def on_map(self, message: OccupancyGrid) -> None:
        """Take a map, which explains what is no person."""
        if self.config.stands_in == (message.header.frame_id or MAP_FRAME):
            self.walls = KnownWalls(grid_of(message), self.config.walls)

    def on_scan(self, message: LaserScan) -> None:
        """Take a scan, now or as soon as it is known from where it was taken."""
        self.newest = message
        self.take_scan()

    def take_scan(self) -> None:
        """Take the newest scan, unless that has been done."""
        if (message := self.newest) is None:
            return
        if (frame := message.header.frame_id.lstrip("/")) not in ("", self.config.frame):
            self.problem = f"scans are in '{frame}', and expected in '{self.config.frame}'"
            return
        try:
            at = self.bound["laser"].transform(at=to_nanoseconds(message.header.stamp) or None)
        except LookupError as error:
            self.problem = str(error)
            return
        self.newest, self.problem, self.taken = None, "", self.now
        most = min(self.config.farthest, message.range_max)
        found = sightings(at.to_pose2(), *rays_of(message), most, self.walls)
        self.tracks.see(found, self.now)
        self.tell()

    def tell(self) -> None:
        """Publish who is seen."""
        found = self.tracks.people(self.now)
        header = Header(stamp=to_time(self.stamp), frame_id=self.config.stands_in)
        self.people(People(header, tuple(map(person_message, found))))
        self.markers(people_markers(found, header))

    def step(self, dt: float) -> None:
        """Publish what missions read."""
        self.take_scan()
        found = self.tracks.people(self.now)
        is_blind = bool(self.problem) and self.now - max(self.taken, 0.0) > BLIND
        self.status(Level.WARN if is_blind else Level.OK, self.problem if is_blind else "sees", people=len(found))
        if (base := self.bound["base"].now()) is None:
            return
        nearest = min(
            (one for one in found if one.reliability >= SURE),
            key=lambda one: math.hypot(one.x - base.x, one.y - base.y),
            default=None,
        )
        self.seen(Bool(data=nearest is not None))
        if nearest is None:
            self.distance(Float32(data=self.config.farthest))
            return
        self.distance(Float32(data=math.hypot(nearest.x - base.x, nearest.y - base.y)))
        walks = math.atan2(nearest.vy, nearest.vx)
        header = Header(stamp=to_time(self.stamp), frame_id=self.config.stands_in)
        self.person(PoseStamped(header, message_of(Pose2(nearest.x, nearest.y, walks))))


def person_message(one: TrackedPerson) -> Person:
    """Return somebody as ROS's people stack does."""
    return Person(one.name, Point(x=one.x, y=one.y), Point(x=one.vx, y=one.vy), one.reliability, tagnames=(), tags=())


def people_markers(found: list[TrackedPerson], header: Header) -> MarkerArray:
    """Return markers in place of all that were there before: a circle and a name for each, grey if it has not moved."""
    drawn = [Marker(header=header, action=Marker.DELETEALL)]
    corners = [math.tau * (side % SIDES) / SIDES for side in range(SIDES + 1)]
    for number, one in enumerate(found):
        colour = SURE_COLOUR if one.reliability >= SURE else UNSURE_COLOUR
        circle = tuple(Point(one.x + RADIUS * math.cos(at), one.y + RADIUS * math.sin(at), 0.0) for at in corners)
        outline = Marker(
            header=header,
            ns="people",
            id=2 * number,
            type=Marker.LINE_STRIP,
            points=circle,
            scale=Vector3(x=LINE),
            color=colour,
        )
        name = Marker(
            header=header,
            ns="people",
            id=2 * number + 1,
            type=Marker.TEXT_VIEW_FACING,
            pose=Pose(position=Point(one.x, one.y, 0.0)),
            scale=Vector3(z=TEXT),
            color=colour,
            text=one.name.replace("_", " "),
        )
        drawn += [outline, name]
    return MarkerArray(markers=tuple(drawn))
