"""Battery thresholds in the wrong order."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import setting, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.units import RATIO, format_quantity

BATTERY = "battery_sim"


@check("RBX3502")
def threshold_order(robot: Robot) -> Iterator[Finding]:
    """A battery is in error before it warns

    Below `warn` the status of a battery is WARN, below `error` it is ERROR. With `error` above `warn`, there is never a
    warning.

    Bad:
    ```yaml
    components:
      battery:
        type: battery_sim
        runtime: 45 s
        warn: 20 %
        error: 50 %
    ```
    Good:
    ```yaml
    components:
      battery:
        type: battery_sim
        runtime: 45 s
        warn: 50 %
        error: 20 %
    ```
    """
    for part in robot.parts.values():
        if part.type_name != BATTERY:
            continue
        warn, error = setting(part, "warn"), setting(part, "error")
        if warn is not None and error is not None and warn < error:
            yield threshold_order.at(
                setting_span(robot, (part, "warn"), (part, "error")),
                f"'{part.name}' can never warn: it is in error below {format_quantity(error, RATIO)} already, "
                f"and warns below {format_quantity(warn, RATIO)}",
                help="'warn' must be above 'error'",
                related=[Related(setting_span(robot, (part, "error"), (part, "warn")), "in error below this")],
            )
