"""A type that exists only in simulation."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX8001")
def only_simulated(robot: Robot) -> Iterator[Finding]:
    """A component that exists only in simulation cannot run on the real robot."""
    if robot.manifest.is_simulated:
        return
    for component in robot.components.values():
        if component.cls.simulated:
            yield only_simulated.at(
                robot.value(*component.path, "type"),
                f"'{component.name}' exists only in simulation: '{component.type_name}'",
                help="run it without '--real', or use a type for the real device",
            )
