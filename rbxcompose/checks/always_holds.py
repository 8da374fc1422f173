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
    """A condition always holds

    A battery has 0 % to 100 %, and a distance or an age is never below zero. A condition that is true for every
    possible value decides nothing.

    Bad:
    ```yaml
    do:
      if: $battery <= 100 %
      then: recharge
    ```
    Good:
    ```yaml
    do:
      if: $battery < 50 %
      then: recharge
    ```
    """
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
