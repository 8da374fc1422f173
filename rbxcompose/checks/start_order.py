"""A start order that cannot be satisfied."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.order import cycle_of
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES


@check("RBX3006", is_fixable=True, closed=(NAMES,))
def start_order(robot: Robot) -> Iterator[Finding]:
    """`starts_after:` names no component, or forms a circle."""
    after = {name: component.starts_after for name, component in robot.components.items()}
    for name, component in robot.components.items():
        for index, other in enumerate(component.starts_after):
            if other not in robot.components and other not in robot.written:
                yield start_order.misspelt(
                    robot.value(*component.path, "starts_after", index),
                    f"'{name}' starts after a component that the robot does not have: '{other}'",
                    other,
                    robot.components,
                    "components of this robot",
                )
    if cycle := cycle_of(after):
        yield start_order.at(
            robot.value(*robot.components[cycle[0]].path, "starts_after"),
            f"the start order forms a circle: {' after '.join([*cycle, cycle[0]])}",
            help="remove one of them",
        )
