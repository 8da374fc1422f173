"""A heading beyond a full turn."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.units import ANGLE, format_quantity


@check("RBX3507", Severity.WARNING, closed=())
def full_turn(robot: Robot) -> Iterator[Finding]:
    """The heading of a place is beyond a full turn."""
    for name, place in robot.manifest.places.items():
        if abs(place.heading) > math.tau + 1e-9:
            yield full_turn.at(
                robot.value("places", name, "heading"),
                f"the heading of '{name}' is more than a full turn",
                label=f"this is {format_quantity(round(place.heading, 3), ANGLE)}",
                help="write it in 'deg'",
            )
