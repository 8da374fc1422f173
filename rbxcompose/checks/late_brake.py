"""A base that goes on long after the last command."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.flow import OTHER_TYPE, is_written, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.units import LENGTH, TIME, format_quantity

LONGEST = 10.0  # [s]: commands come many times a second
FARTHEST = 2.0  # [m] driven blind; the usual 0.5 s are that far at 4 m/s only


@check("RBX3509", Severity.WARNING, closed=())
def late_brake(robot: Robot) -> Iterator[Finding]:
    """A base goes on long after the last command."""
    for base, drives in robot.declared(Drives):
        allowed = drives.stops_after
        is_chosen = allowed is not None and is_written(robot, base, allowed.field)
        blind = allowed.value * drives.max_speed.value if allowed and drives.max_speed and is_chosen else 0.0
        if allowed and (allowed.value > LONGEST or blind > FARTHEST):
            shown = "without end" if math.isinf(allowed.value) else f"for {format_quantity(allowed.value, TIME)}"
            if 0.0 < blind < math.inf:
                shown += f", {format_quantity(blind, LENGTH)} at full speed,"
            yield late_brake.at(
                setting_span(robot, (base, allowed.field)),
                f"'{base.name}' goes on {shown} after its last command",
                help="a few times the time between two commands is enough, such as '0.5 s'"
                if allowed.field
                else OTHER_TYPE,
            )
