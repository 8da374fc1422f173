"""A condition always holds."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.blame import blamed, decided
from rbxcompose.model.robot import Robot
from rbxcompose.rules import MISSIONS


@check("RBX4123", Severity.WARNING, closed=(MISSIONS,))
def always_holds(robot: Robot) -> Iterator[Finding]:
    """A condition always holds."""
    for mission in robot.missions.values():
        for asked, holds in decided(robot, mission):
            if holds is True:
                span, related = blamed(robot, mission, asked)
                yield always_holds.at(
                    span,
                    f"the condition '{asked.expression.text}' always holds",
                    help="compare with a level that makes a difference",
                    related=related,
                )
