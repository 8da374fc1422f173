"""A place that is far from all the others."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import median

from rbxcompose.check_runner import check
from rbxcompose.config import Place
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.travel_times import distance
from rbxcompose.model.robot import Robot
from rbxcompose.units import LENGTH, format_quantity

_LEAST = 3  # places
_FAR = 30.0  # [m]
_TIMES = 50.0  # as far away as the others are from each other


@check("RBX3512", Severity.WARNING, closed=("places",))
def far_place(robot: Robot) -> Iterator[Finding]:
    """A place is far from all the others."""
    for place in far_places(robot):
        away = min(distance(place, one) for name, one in robot.manifest.places.items() if name != place.name)
        yield far_place.at(
            robot.key("places", place.name),
            f"the place '{place.name}' is {format_quantity(round(away, 1), LENGTH)} away from all the others",
            help="is the unit right? Places are in metres: write 'cm' or 'mm' where that is meant",
        )


def far_places(robot: Robot) -> list[Place]:
    """Return the places that are much farther away from all others than those are from each other; mostly none."""
    places = list(robot.manifest.places.values())
    if len(places) < _LEAST:
        return []
    centre = Place("", median(one.x for one in places), median(one.y for one in places), 0.0)
    near = sorted(distance(one, centre) for one in places)[:-1]
    return [one for one in places if distance(one, centre) > max(_FAR, _TIMES * near[-1])]
