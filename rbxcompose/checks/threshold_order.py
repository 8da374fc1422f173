"""Battery thresholds in the wrong order."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.sdk.capabilities import Drains, Setting, Warns
from rbxcompose.units import RATIO, format_quantity


@check("RBX3502")
def threshold_order(robot: Robot) -> Iterator[Finding]:
    """An error is reported before a warning."""
    for component, drains in robot.declared(Drains):
        yield from _disorder(robot, component, drains.warn, drains.error, "below", lambda x: format_quantity(x, RATIO))
    for component, warns in robot.declared(Warns):
        side = "above" if warns.is_above else "below"
        yield from _disorder(robot, component, warns.warn, warns.error, side, lambda x: f"{x:g}")


def _disorder(
    robot: Robot,
    component: RobotComponent,
    warn: Setting[float] | None,
    error: Setting[float] | None,
    side: str,
    text: Callable[[float], str],
) -> Iterator[Finding]:
    if not (warn and error) or (warn.value <= error.value if side == "above" else warn.value >= error.value):
        return
    here, there = (component, warn.field), (component, error.field)
    other = "below" if side == "above" else "above"
    yield threshold_order.at(
        setting_span(robot, here, there),
        f"'{component.name}' can never warn: it is already in error {side} {text(error.value)}, "
        f"and warns {side} {text(warn.value)}",
        help=f"'{warn.field or 'warn'}' must be {other} '{error.field or 'error'}'",
        related=[Related(setting_span(robot, there, here), f"in error {side} this")],
    )
