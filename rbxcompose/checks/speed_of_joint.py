"""A controller that is faster than its joint."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.driven_joints import ROUNDED, driven_joints
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import BoundsGoals


@check("RBX2245", Severity.WARNING, closed=(WIRING,))
def speed_of_joint(robot: Robot) -> Iterator[Finding]:
    """A controller is to be faster than its joint."""
    declared = [(one, bounds) for one, bounds in robot.declared(BoundsGoals) if bounds.speed and bounds.joints]
    led = {one.name: one for one in driven_joints(robot)} if declared else {}
    for component, bounds in declared:
        for name in bounds.joints.value.values() if bounds.joints else ():
            most = led[name].joint.limits.velocity if name in led else None
            if bounds.speed and most and bounds.speed.value > most * (1.0 + ROUNDED):
                can = led[name].speed(most)
                yield speed_of_joint.at(
                    setting_span(robot, (component, bounds.speed.field)),
                    f"it is to reach {led[name].speed(bounds.speed.value)}, and '{name}' can do {can} at most",
                    help=f"make it at most {can}",
                    related=[Related(led[name].key(), "the joint")],
                )
