"""A speed without a unit that no robot reaches."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import ScalarNode, at
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.sdk.capabilities import CommandsMotion, Drives, Setting
from rbxcompose.units import ANGULAR_SPEED, SPEED, Dimension

_MOST = {SPEED: (30.0, "m/s", "cm/s"), ANGULAR_SPEED: (15.0, "rad/s", "deg/s")}


@check("RBX3513", Severity.WARNING, closed=())
def plain_number(robot: Robot) -> Iterator[Finding]:
    """A speed without a unit is faster than robots are."""
    for component in robot.components.values():
        speeds: list[Drives | CommandsMotion] = [*component.declared(Drives), *component.declared(CommandsMotion)]
        for one in speeds if component.is_sound else ():
            yield from _told(robot, component, one.max_speed, SPEED)
            yield from _told(robot, component, one.max_turn_rate, ANGULAR_SPEED)


def _told(
    robot: Robot, component: RobotComponent, setting: Setting[float] | None, dimension: Dimension
) -> Iterator[Finding]:
    most, unit, likely = _MOST[dimension]
    node = at(robot.manifest.root, component.place(setting.field)) if setting and setting.field else None
    if not isinstance(node, ScalarNode) or node.filled is not None or not setting or setting.value < most:
        return
    if isinstance(plain_value(node), int | float):
        yield plain_number.at(
            node.span,
            f"'{setting.field}' of '{component.name}' has no unit, so it is {setting.value:g} {unit}",
            help=f"write its unit: '{setting.value:g} {likely}'",
        )
