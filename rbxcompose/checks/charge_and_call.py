"""A charge that ends below the level that triggers it."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.blame import blamed
from rbxcompose.model.charge import calls
from rbxcompose.model.robot import Robot
from rbxcompose.units import RATIO, format_quantity


@check("RBX4121")
def charge_and_call(robot: Robot) -> Iterator[Finding]:
    """A charge ends below the level that triggers it."""
    for mission in robot.missions.values():
        for call in calls(robot, mission):
            until = call.charges.until
            if until and until.value < call.level <= 1.0:
                span, related = blamed(robot, mission, call.interrupt.when)
                yield charge_and_call.at(
                    span,
                    f"the interrupt '{call.interrupt.name}' charges below {format_quantity(call.level, RATIO)}, "
                    f"but a charge may end at {format_quantity(until.value, RATIO)}",
                    help="charge at a lower level",
                    related=related,
                )
