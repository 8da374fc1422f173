"""An access that somebody else's router does not know of."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot


@check("RBX3025")
def access_elsewhere(robot: Robot) -> Iterator[Finding]:
    """The access is restricted at a router that is not the robot's own."""
    bus = robot.manifest.bus
    if bus.access == "user" and bus.router is not None:
        yield access_elsewhere.at(
            robot.value("bus", "access"),
            "'access: user' has no effect on an existing router",
            help="remove 'router', or protect that router itself and remove 'access'",
            related=[Related(robot.value("bus", "router"), "the router that decides who takes part")],
        )
