"""A joint that may move as fast as its servo can."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.driven_joints import driven_joints
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING


@check("RBX2229", Severity.WARNING, closed=(WIRING,))
def no_speed_limit(robot: Robot) -> Iterator[Finding]:
    """A joint has no limit of its speed."""
    for one in driven_joints(robot):
        if one.joint.mode == "position" and one.joint.limits.velocity is None and not one.mimics:
            yield no_speed_limit.at(
                one.key(),
                f"'{one.name}' has no limit of its speed: it moves as fast as its servo can",
                help=f"add one in {'m/s' if one.slides else 'deg/s'}: 'limits: {{velocity: ...}}'",
            )
