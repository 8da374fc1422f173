"""A base that brakes between two commands."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import Flow, period_of, setting, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.units import TIME, format_quantity


@check("RBX3501")
def command_timeout(robot: Robot) -> Iterator[Finding]:
    """A base brakes between two commands

    A base brakes when no command arrives within its `command_timeout`. The component that drives it must send more
    often than that.

    Bad:
    ```yaml
    components:
      base:
        type: diff_drive_sim
        command_timeout: 20 ms
    ```
    Good:
    ```yaml
    components:
      base:
        type: diff_drive_sim
        command_timeout: 0.5 s
    ```
    """
    flow = Flow(robot)
    for base in robot.parts.values():
        allowed = setting(base, "command_timeout")
        if allowed is None:
            continue
        for end, source in flow.fed_by(base):
            period = period_of(source)
            if end.name == "cmd_vel" and period is not None and allowed <= period:
                yield command_timeout.at(
                    setting_span(robot, (base, "command_timeout")),
                    f"'{base.name}' brakes before '{source.name}' sends its next command",
                    label=f"it sends every {format_quantity(period, TIME)}",
                    help=f"make it several times as long: '{format_quantity(10 * period, TIME)}'",
                    related=[Related(robot.part_span(source.name), "sends the commands")],
                )
