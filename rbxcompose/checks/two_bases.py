"""Two bases on one command topic."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Related, Span
from rbxcompose.model.robot import Part, Robot
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.qos import Qos
from rbxcompose.sdk.ports import In, Out


@check("RBX3013")
def two_bases(robot: Robot) -> Iterator[Finding]:
    """Two bases follow the same commands

    A base takes commands and publishes its position as odometry. If two bases follow one topic, both move and both say
    where the robot is: a component that drives to a place would see two poses in turn.

    Bad:
    ```yaml
    components:
      base:
        type: diff_drive_sim
      spare:
        type: diff_drive_sim
        connect:
          odom: spare/odom
    ```
    Good:
    ```yaml
    components:
      base:
        type: diff_drive_sim
    ```
    """
    for topic, ends in robot.readers.items():
        takers = [end.instance for end in ends if isinstance(end.port, In) and end.port.qos is Qos.COMMAND]
        bases = [name for name in takers if _tells_odometry(robot.parts[name])]
        for other in bases[1:]:
            yield two_bases.at(
                _entry(robot, other),
                f"'{other}' and '{bases[0]}' are both bases that follow '{topic}'",
                label="this one",
                help="a robot has one base: leave one of them out",
                related=[Related(_entry(robot, bases[0]), "and this one")],
            )


def _entry(robot: Robot, name: str) -> Span:
    """Return the place of the robot's own entry that brings a component: that of the component, or of its part."""
    brought = (one.span for one in robot.manifest.parts.values() if name in one.components)
    return next(brought, None) or robot.part_span(name)


def _tells_odometry(part: Part) -> bool:
    return any(isinstance(end.port, Out) and end.port.interface is Odometry for end in part.ends)
