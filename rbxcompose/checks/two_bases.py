"""Two bases on one command topic."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import Drives


@check("RBX3013", closed=(WIRING,))
def two_bases(robot: Robot) -> Iterator[Finding]:
    """Two bases follow the same commands."""
    for topic, ends in robot.readers.items():
        bases = [end for end in ends if _moves(robot, end)]
        for other in bases[1:]:
            yield two_bases.at(
                robot.entry_span(other.instance, other.name),
                f"'{other.instance}' and '{bases[0].instance}' are both bases that follow '{topic}'",
                label="this one",
                help="a robot has one base: remove one of them",
                related=[Related(robot.entry_span(bases[0].instance, bases[0].name), "and this one")],
            )


def _moves(robot: Robot, end: PortEnd) -> bool:
    """Return whether commands received at this end move the robot."""
    return any(end.name == one.commands for one in robot.components[end.instance].declared(Drives))
