"""A speed at which the base ignores its commands."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.clamped_speed import excesses
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX3504")
def absurd_speed(robot: Robot) -> Iterator[Finding]:
    """A component drives so fast that its base drops the commands."""
    for one in excesses(robot):
        if one.is_absurd:
            drops = f"drops commands above {one.times} its limit of {one.shown(one.limit)}"
            yield one.finding(robot, absurd_speed, drops)
