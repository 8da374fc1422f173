"""Zones and people as markers, for viewers: a closed line around each, and its name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from rbxcompose.domains.navigation.companion import SURE
from rbxcompose.domains.navigation.costs import CostZone
from rbxcompose.domains.navigation.people import TrackedPerson
from rbxcompose.domains.worlds.shapes import Point2
from rbxcompose.msgs.geometry_msgs import Point, Pose, Vector3
from rbxcompose.msgs.std_msgs import ColorRGBA, Header
from rbxcompose.msgs.visualization_msgs import Marker, MarkerArray

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
