"""Real drivers that follow an outside clock."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX8002")
def external_clock(robot: Robot) -> Iterator[Finding]:
    """The real robot must keep its own time."""
    if robot.manifest.is_simulated or robot.manifest.bus.clock != "external":
        return
    yield external_clock.at(
        robot.value("bus", "clock"),
        "the real robot cannot follow the time of a simulator",
        help="run it without '--real', or remove 'clock'",
    )
