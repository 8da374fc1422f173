"""A timeout that cannot be met."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.far_place import far_places
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.facts import place_in_text
from rbxcompose.missions.analysis.travel_times import distance, too_short
from rbxcompose.model.charge import constants, ways_of
from rbxcompose.model.robot import Robot
from rbxcompose.units import LENGTH, TIME, format_quantity


@check("RBX4120", Severity.WARNING)
def timeout_and_way(robot: Robot) -> Iterator[Finding]:
    """A timeout is shorter than the step it limits."""
    far = far_places(robot)  # told as RBX3512
    for mission in robot.missions.values():
        ways = ways_of(robot, mission)
        for one in too_short(ways, constants(mission)) if ways else ():
            if one.leg and any(place in far for place in one.leg):
                continue
            what, related = "this step", []
            if one.leg:
                here, there = one.leg
                away = format_quantity(round(distance(here, there), 2), LENGTH)
                what = f"the way from '{here.name}' to '{there.name}' ({away})"
                related = [Related(robot.key("places", place.name), f"'{place.name}'") for place in one.leg]
            yield timeout_and_way.at(
                place_in_text(one.node, one.node.limit),
                f"{what} takes at least {format_quantity(round(one.needs, 2), TIME)}, "
                f"but has {format_quantity(one.given, TIME)}",
                help="give it two or three times as long as it needs",
                related=related,
            )
