"""How people who are tracked are told: as ROS's people stack does, to viewers, and to missions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, TypeVar

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.levels import Level
from rbxcompose.domains.navigation.companion import SURE
from rbxcompose.domains.navigation.costs import CostZone
from rbxcompose.domains.navigation.people import TrackedPerson
from rbxcompose.domains.worlds.shapes import Point2
from rbxcompose.domains.worlds.world import MAP_FRAME
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, Vector3
from rbxcompose.msgs.people_msgs import People, Person
from rbxcompose.msgs.poses import message_of
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Bool, ColorRGBA, Float32, Header
from rbxcompose.msgs.visualization_msgs import Marker, MarkerArray

BLIND = 2.0  # [s] without anything that can be used


class PeopleConfig(sdk.Config):
    """Where people are, and how far."""

    stands_in: str = Field(MAP_FRAME, min_length=1)
    """The frame in which people are: `map`, or `odom` for a robot without a map."""
    farthest: sdk.Length = Field(6.0, gt=0)
    """Who is farther away is not tracked."""
    forget: sdk.Time = Field(2.0, gt=0)
    """Who was hidden for longer is somebody else."""


C = TypeVar("C", bound=PeopleConfig)


class TellsPeople(sdk.Component[C]):
    """Publishes who is seen: `people`, markers, and for missions the nearest who is no furniture."""

    people = sdk.Out(People, "people")
    markers = sdk.Out(MarkerArray, "people_markers")
    person = sdk.Out(PoseStamped, "person")
    distance = sdk.Out(Float32, "person_distance", unit="m")
    seen = sdk.Out(Bool, "person_seen")

    @classmethod
    def ports(cls, config: C) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with where the robot is."""
        base = sdk.Looks(source="base_footprint", target=config.stands_in).named("base")
        return super().ports(config) | {"base": base}

    def tell(self, found: Sequence[TrackedPerson]) -> None:
        """Publish who is seen."""
        header = Header(stamp=to_time(self.stamp), frame_id=self.config.stands_in)
        told = (
            Person(one.name, Point(one.x, one.y), Point(one.vx, one.vy), one.reliability, tagnames=(), tags=())
            for one in found
        )
        self.people(People(header, tuple(told)))
        self.markers(people_markers(found, header))

    def report(self, found: Sequence[TrackedPerson], problem: str, taken: float) -> None:
        """Publish what missions read, and what is wrong since it saw for the last time, at `taken` [s]."""
        is_blind = bool(problem) and self.now - max(taken, 0.0) > BLIND
        self.status(Level.WARN if is_blind else Level.OK, problem if is_blind else "sees", people=len(found))
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


RED, YELLOW = ColorRGBA(r=0.86, g=0.16, b=0.16, a=1.0), ColorRGBA(r=0.83, g=0.6, b=0.0, a=1.0)
BLUE, GREY = ColorRGBA(r=0.1, g=0.45, b=0.9, a=1.0), ColorRGBA(r=0.5, g=0.5, b=0.5, a=1.0)
LINE, TEXT = 0.04, 0.25  # [m], widths of lines and heights of texts
RADIUS, SIDES = 0.25, 16  # [m] and corners of the circle that stands for a person


def zone_markers(zones: Sequence[CostZone], header: Header) -> MarkerArray:
    """Return markers in place of all that were there before: red to keep out, yellow to slow down."""
    found = [Marker(header=header, action=Marker.DELETEALL)]
    for number, zone in enumerate(zones):
        slow = "speed", YELLOW, f"{100 * zone.share:.0f} %"
        kind, colour, asks = slow if zone.share else ("keepout", RED, "keep out")
        found += _outlined(header, kind, number, zone.corners, colour, f"{zone.name}: {asks}")
    return MarkerArray(markers=tuple(found))


def people_markers(people: Sequence[TrackedPerson], header: Header) -> MarkerArray:
    """Return markers in place of all that were there before: a circle and a name for each, grey if it has not moved."""
    found = [Marker(header=header, action=Marker.DELETEALL)]
    around = [math.tau * side / SIDES for side in range(SIDES)]
    for number, one in enumerate(people):
        colour = BLUE if one.reliability >= SURE else GREY
        circle = [(one.x + RADIUS * math.cos(at), one.y + RADIUS * math.sin(at)) for at in around]
        found += _outlined(header, "people", number, circle, colour, one.name.replace("_", " "))
    return MarkerArray(markers=tuple(found))


def _outlined(
    header: Header, kind: str, number: int, corners: Sequence[Point2], colour: ColorRGBA, text: str
) -> tuple[Marker, Marker]:
    """Return a line around corners [m], and a text in their middle."""
    points = tuple(Point(x, y, 0.0) for x, y in (*corners, corners[0]))
    xs, ys = zip(*corners, strict=True)
    middle = Pose(position=Point(sum(xs) / len(xs), sum(ys) / len(ys), 0.0))
    mark = partial(Marker, header=header, ns=kind, color=colour)
    line = mark(id=2 * number, type=Marker.LINE_STRIP, points=points, scale=Vector3(x=LINE))
    name = mark(id=2 * number + 1, type=Marker.TEXT_VIEW_FACING, pose=middle, scale=Vector3(z=TEXT), text=text)
    return line, name
