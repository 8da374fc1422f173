"""Commands without a subscriber."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.needed_port import is_unheard
from rbxcompose.findings import Finding, Related, Severity, suggest
from rbxcompose.model.robot import Robot


@check("RBX3011", Severity.WARNING)
def unheard_command(robot: Robot) -> Iterator[Finding]:
    """Commands are published on a topic without a subscriber

    The publisher assumes that it drives the robot, but nothing moves. A mux is named after the topic that it publishes;
    a base subscribes to `cmd_vel`.

    Bad:
    ```yaml
    components:
      base:
        type: diff_drive_sim
        connect:
          cmd_vel: wheels/cmd_vel
    ```
    Good:
    ```yaml
    components:
      base:
        type: diff_drive_sim
    ```
    """
    for end in robot.ends:
        if is_unheard(robot, end):
            waiting = [one for ends in robot.readers.values() for one in ends if one.type_name == end.type_name]
            starving = [one for one in waiting if one.topic not in robot.writers and one.instance != end.instance]
            topics = [one.topic.strip("/") for one in starving]
            yield unheard_command.at(
                robot.end_span(end),
                f"nothing subscribes to the commands of '{end.instance}' on '{end.topic}'",
                help=suggest(end.topic.strip("/"), topics, "topics that wait for such commands"),
                related=[Related(robot.end_span(one), f"listens to '{one.topic}'") for one in starving],
            )
