"""A start mission that is not there."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX3009", is_fixable=True)
def start_mission(robot: Robot) -> Iterator[Finding]:
    """`start:` names a mission that the robot does not have

    Bad:
    ```yaml
    missions:
      patrol: ../../missions/patrol.yaml
    start: patrl
    ```
    Good:
    ```yaml
    missions:
      patrol: ../../missions/patrol.yaml
    start: patrol
    ```
    """
    start = robot.manifest.start
    if start is not None and start not in robot.manifest.missions:
        yield start_mission.misspelt(
            robot.value("start"),
            f"the robot has no mission '{start}' to start",
            start,
            robot.manifest.missions,
            "missions of this robot",
        )
