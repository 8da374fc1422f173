"""A dock at which the robot may stop too far away."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.flow import OTHER_TYPE, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import Charges, Navigates
from rbxcompose.units import LENGTH, format_quantity

_ABSURD = 1.0  # [m] of a tolerance, which is then what is wrong


@check("RBX3505", Severity.WARNING, closed=())
def charger_reach(robot: Robot) -> Iterator[Finding]:
    """The robot may stop too far from its dock to be charged."""
    drivers = [(component, one.tolerance) for component, one in robot.declared(Navigates) if one.tolerance]
    if not drivers:
        return
    driver, tolerance = min(drivers, key=lambda one: one[1].value)
    for component, charges in robot.declared(Charges):
        reach = charges.reach
        if reach and charges.place and reach.value < tolerance.value:
            here, there = (component, reach.field), (driver, tolerance.field)
            changes = [f"'{name}' {how}" for name, how in ((here[1], "larger"), (there[1], "smaller")) if name]
            both = (there, here) if tolerance.value > _ABSURD else (here, there)
            yield charger_reach.at(
                setting_span(robot, *both),
                f"'{component.name}' charges within {format_quantity(reach.value, LENGTH)} of the dock, "
                f"but '{driver.name}' may end {format_quantity(tolerance.value, LENGTH)} away from it",
                help=f"make {', or '.join(changes)}" if changes else OTHER_TYPE,
                related=[Related(setting_span(robot, there), f"its '{there[1]}'" if there[1] else "drives there")],
            )
