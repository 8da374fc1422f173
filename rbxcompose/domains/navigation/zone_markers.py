"""Zones of the map as markers, for viewers: a closed line around each, and what it asks for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from rbxcompose.domains.navigation.costs import CostZone
from rbxcompose.msgs.geometry_msgs import Point, Pose, Vector3
from rbxcompose.msgs.std_msgs import ColorRGBA, Header
from rbxcompose.msgs.visualization_msgs import Marker, MarkerArray

RED, YELLOW = ColorRGBA(r=0.86, g=0.16, b=0.16, a=1.0), ColorRGBA(r=0.83, g=0.6, b=0.0, a=1.0)
LINE, TEXT = 0.04, 0.25  # [m], widths of lines and heights of texts


def zone_markers(zones: Sequence[CostZone], header: Header) -> MarkerArray:
    """Return markers in place of all that were there before: red to keep out, yellow to slow down."""
    found = [Marker(header=header, action=Marker.DELETEALL)]
    for number, zone in enumerate(zones):
        slow = "speed", YELLOW, f"{100 * zone.share:.0f} %"
        kind, colour, asks = slow if zone.share else ("keepout", RED, "keep out")
        points = tuple(Point(x, y, 0.0) for x, y in (*zone.corners, zone.corners[0]))
        xs, ys = zip(*zone.corners, strict=True)
        middle = Pose(position=Point(sum(xs) / len(xs), sum(ys) / len(ys), 0.0))
        marker = partial(Marker, header=header, ns=kind, color=colour)
        found += [
            marker(id=2 * number, type=Marker.LINE_STRIP, points=points, scale=Vector3(x=LINE)),
            marker(
                id=2 * number + 1,
                type=Marker.TEXT_VIEW_FACING,
                pose=middle,
                scale=Vector3(z=TEXT),
                text=f"{zone.name}: {asks}",
            ),
        ]
    return MarkerArray(markers=tuple(found))
