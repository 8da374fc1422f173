"""A speed at which the base ignores its commands."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.clamped_speed import excesses
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX3504")
def absurd_speed(robot: Robot) -> Iterator[Finding]:
    """A component drives so fast that its base drops the commands

    A base treats a command above twice its limit as a fault of the sender and ignores it, so the robot would not move.
    Often a unit is wrong.

    Bad:
    ```yaml
    components:
      go_to:
        type: go_to
        speed: 3 m/s
    ```
    Good:
    ```yaml
    components:
      go_to:
        type: go_to
        speed: 0.3 m/s
    ```
    """
    for one in excesses(robot):
        if one.is_absurd:
            drops = f"drops commands above {one.times} its limit of {one.shown(one.limit)}"
            yield one.finding(robot, absurd_speed, drops)
