"""Components of the robot in the process of the simulated world."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot

WORLD = "world"


@check("RBX6001", Severity.WARNING, closed=())
def world_group(robot: Robot) -> Iterator[Finding]:
    """The process group `world` is for simulated truth only."""
    for component in robot.components.values():
        if component.process == component.cls.process or WORLD not in (component.process, component.cls.process):
            continue
        if component.process == WORLD == robot.manifest.process:
            continue
        if component.cls.process == WORLD:
            message = f"'{component.name}' is simulated and belongs in the group 'world', not in '{component.process}'"
        else:
            message = f"'{component.name}' is not part of the simulated world, but runs in its group"
        is_of_all = component.process == robot.manifest.process
        place = robot.value("process") if is_of_all else robot.value(*component.path, "process")
        yield world_group.at(place, message, help="write 'process: world'" if is_of_all else "remove 'process'")
