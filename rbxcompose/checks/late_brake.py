"""A base that goes on long after the last command."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.flow import OTHER_TYPE, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.units import TIME, format_quantity

LONGEST = 10.0  # [s]: commands come many times a second


@check("RBX3509", Severity.WARNING, closed=())
def late_brake(robot: Robot) -> Iterator[Finding]:
    """A base goes on long after the last command

    A base brakes when no command has arrived for its `command_timeout`: then whatever drives it has failed. Until then
    it goes on with the last velocity. Commands come many times a second. A bare number counts in seconds: `500` is more
    than eight minutes.

    Bad:
    ```yaml
    components:
      base:
        type: diff_drive_sim
        command_timeout: 500
    ```
    Good:
    ```yaml
    components:
      base:
        type: diff_drive_sim
        command_timeout: 500 ms
    ```
    """
    for base, drives in robot.declared(Drives):
        allowed = drives.stops_after
        if allowed and allowed.value > LONGEST:
            shown = format_quantity(allowed.value, TIME)
            yield late_brake.at(
                setting_span(robot, (base, allowed.field)),
                f"'{base.name}' goes on for {shown} after its last command",
                help="a few times the time between two commands is enough, such as '0.5 s'"
                if allowed.field
                else OTHER_TYPE,
            )
