"""A battery that is in error before the mission charges it."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.blame import blamed
from rbxcompose.model.charge import calls
from rbxcompose.model.flow import is_written, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.units import RATIO, format_quantity


@check("RBX4160", Severity.WARNING)
def late_call(robot: Robot) -> Iterator[Finding]:
    """The battery is in error before the mission charges it."""
    for mission in robot.missions.values():
        for call in calls(robot, mission):
            error = call.drains.error
            if error and call.level < error.value and is_written(robot, call.battery, error.field):
                span, related = blamed(robot, mission, call.interrupt.when)
                level, limit = format_quantity(call.level, RATIO), format_quantity(error.value, RATIO)
                yield late_call.at(
                    span,
                    f"'{mission.name}' charges '{call.battery.name}' below {level}; it is in error below {limit}",
                    help=f"charge it at {limit} or above, or put its '{error.field or 'error'}' below {level}",
                    related=[*related, Related(setting_span(robot, (call.battery, error.field)), "its status")],
                )
