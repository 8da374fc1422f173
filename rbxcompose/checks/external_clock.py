"""Real drivers that follow an outside clock."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX8002")
def external_clock(robot: Robot) -> Iterator[Finding]:
    """The real robot must keep its own time

    With `clock: external`, robot time follows a simulator: it may run slower, stand still or jump. A real motor keeps
    running meanwhile, and no deadline would stop it.

    Bad: `rbxcompose up robot.yaml --real`, with
    ```yaml
    bus:
      clock: external
    ```
    Good: its own clock, which is the default; a profile for the simulator may choose `external`.
    ```yaml
    bus:
      clock: own
    ```
    """
    if robot.manifest.is_simulated or robot.manifest.bus.clock != "external":
        return
    yield external_clock.at(
        robot.value("bus", "clock"),
        "the real robot cannot follow the time of a simulator",
        help="run it without '--real', or remove 'clock'",
    )
