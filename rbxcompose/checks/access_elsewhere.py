"""An access that somebody else's router does not know of."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot


@check("RBX3025")
def access_elsewhere(robot: Robot) -> Iterator[Finding]:
    """The access is restricted at a router that is not the robot's own

    `access: user` lets only this user's programs take part, by Unix sockets of the robot's own router. With `router:`
    the robot uses an existing one instead, and whoever reaches that one can command the robot.

    Bad:
    ```yaml
    bus:
      access: user
      router: tcp/192.168.0.2:7447
    ```
    Good:
    ```yaml
    bus:
      access: user
    ```
    """
    bus = robot.manifest.bus
    if bus.access == "user" and bus.router is not None:
        yield access_elsewhere.at(
            robot.value("bus", "access"),
            "'access: user' has no effect on an existing router",
            help="remove 'router', or protect that router itself and remove 'access'",
            related=[Related(robot.value("bus", "router"), "the router that decides who takes part")],
        )
