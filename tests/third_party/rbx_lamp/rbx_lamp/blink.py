"""The check of blinking that is too fast to see."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity
from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.flow import setting, setting_span
from rbxcompose.compiler.model.robot import Robot

TYPE = "lamp"
SHORTEST = 0.1  # [s]


@check("LAMP01", Severity.WARNING)
def blink(robot: Robot) -> Iterator[Finding]:
    """A lamp that blinks too fast

    The component steps 20 times a second: a period below 0.1 s has no dark half.

    Bad:
    ```yaml
    components:
      lamp: {type: lamp, period: 50 ms}
    ```
    Good:
    ```yaml
    components:
      lamp: {type: lamp, period: 500 ms}
    ```
    """
    for component in robot.components.values():
        period = setting(component, "period") if component.type_name == TYPE else None
        if period is not None and period < SHORTEST:
            message = f"'{component.name}' blinks every {format_quantity(period, TIME)}, which nobody sees"
            yield blink.at(setting_span(robot, (component, "period")), message, help="take 100 ms or more")
