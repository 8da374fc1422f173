"""A dock at which the robot may stop too far away."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.flow import setting, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.units import LENGTH, format_quantity


@check("RBX3505", Severity.WARNING)
def charger_reach(robot: Robot) -> Iterator[Finding]:
    """The robot may stop too far from its dock to be charged

    The component that drives to the dock stops anywhere within its `tolerance`. The `reach` of the charger must not be
    smaller.

    Bad:
    ```yaml
    components:
      charger:
        type: charger
        dock: dock
        reach: 2 cm
    ```
    Good:
    ```yaml
    components:
      charger:
        type: charger
        dock: dock
        reach: 20 cm
    ```
    """
    drivers = {name: found for name, part in robot.parts.items() if (found := setting(part, "tolerance"))}
    for part in robot.parts.values():
        reach = setting(part, "reach")
        if reach is None or not hasattr(part.config, "dock") or not drivers:
            continue
        name = min(drivers, key=lambda one: drivers[one])
        driver, tolerance = robot.parts[name], drivers[name]
        if reach < tolerance:
            yield charger_reach.at(
                setting_span(robot, (part, "reach"), (driver, "tolerance")),
                f"'{part.name}' charges within {format_quantity(reach, LENGTH)} of the dock, "
                f"but '{driver.name}' may end {format_quantity(tolerance, LENGTH)} away from it",
                help="make 'reach' larger, or 'tolerance' smaller",
                related=[Related(setting_span(robot, (driver, "tolerance")), "its 'tolerance'")],
            )
