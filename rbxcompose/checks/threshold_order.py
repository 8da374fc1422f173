"""Battery thresholds in the wrong order."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import Drains
from rbxcompose.units import RATIO, format_quantity


@check("RBX3502")
def threshold_order(robot: Robot) -> Iterator[Finding]:
    """A battery reports an error before it warns

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
    for component, drains in robot.declared(Drains):
        warn, error = drains.warn, drains.error
        if warn and error and warn.value < error.value:
            here, there = (component, warn.field), (component, error.field)
            yield threshold_order.at(
                setting_span(robot, here, there),
                f"'{component.name}' can never warn: "
                f"it is already in error below {format_quantity(error.value, RATIO)}, "
                f"and warns below {format_quantity(warn.value, RATIO)}",
                help=f"'{warn.field or 'warn'}' must be above '{error.field or 'error'}'",
                related=[Related(setting_span(robot, there, here), "in error below this")],
            )
