"""Two components at one serial port."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Related
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.sdk.capabilities import ConnectedBy


@check("RBX2247", closed=())
def shared_port(robot: Robot) -> Iterator[Finding]:
    """Two components use the same serial port."""
    first: dict[str, tuple[str, str]] = {}
    for component, connected in robot.declared(ConnectedBy):
        port, field = connected.port.value, connected.port.field
        other, place = first.setdefault(port, (component.name, field))
        if other != component.name:
            yield shared_port.at(
                setting_span(robot, (component, field)),
                f"'{component.name}' and '{other}' use the same port, {port}",
                help="give each its own port, or put what is on one cable into one of them",
                related=[Related(setting_span(robot, (robot.components[other], place)), f"'{other}'")],
            )
