"""A connected port that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.ports import Looks


@check("RBX3007", is_fixable=True)
def connected_port(robot: Robot) -> Iterator[Finding]:
    """`connect:` names a port that the component does not have."""
    for name, entry in robot.manifest.components.items():
        if name not in robot.components:
            continue
        ports = [end.name for end in robot.components[name].ends if not isinstance(end.port, Looks)]
        for port in entry.options.connect:
            if port not in ports:
                yield connected_port.misspelt(
                    robot.key("components", name, "connect", port),
                    f"'{name}' has no port '{port}'",
                    port,
                    ports,
                    "its ports",
                    taken=entry.options.connect,
                )
