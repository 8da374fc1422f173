"""A base that brakes between two commands."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import OTHER_TYPE, MessageFlow, period_of, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.units import TIME, format_quantity


@check("RBX3501")
def command_timeout(robot: Robot) -> Iterator[Finding]:
    """A base brakes between two commands."""
    flow = MessageFlow(robot)
    for base, drives in robot.declared(Drives):
        allowed = drives.stops_after
        for source in flow.fed_by(base, drives.commands) if allowed else ():
            period = period_of(robot.components[source.instance])
            if allowed and period is not None and allowed.value <= period:
                yield command_timeout.at(
                    setting_span(robot, (base, allowed.field)),
                    f"'{base.name}' brakes before '{source.instance}' sends its next command",
                    label=f"it sends every {format_quantity(period, TIME)}",
                    help=f"make it several times as long: '{format_quantity(10 * period, TIME)}'"
                    if allowed.field
                    else OTHER_TYPE,
                    related=[Related(robot.component_span(source.instance), "sends the commands")],
                )
