"""Positions where joints are never parked."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.sections.safety import safety


@check("RBX2248", Severity.WARNING, closed=())
def never_parked(robot: Robot) -> Iterator[Finding]:
    """Joints have places to be parked at, and are never parked."""
    care = robot.manifest.contents.of(safety)
    if care.park and care.on_shutdown != "park":
        yield never_parked.at(
            robot.key("safety", "park"),
            f"nothing is parked there: on shutdown, joints {care.on_shutdown}",
            help="write 'on_shutdown: park', or remove 'park'",
        )
