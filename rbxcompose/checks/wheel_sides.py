"""A base whose wheels are mistaken for each other, or turn backwards."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.base_wheels import rolling_bases
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING


@check("RBX2282", Severity.WARNING, closed=(WIRING,))
def wheel_sides(robot: Robot) -> Iterator[Finding]:
    """A wheel is on the other side, or turns backwards."""
    for base in rolling_bases(robot):
        component, left = base.component, base.left
        if base.wheel_distance < 0.0:
            yield wheel_sides.at(
                setting_span(robot, (component, left.setting.field)),
                f"in the body, the left wheel '{left.joint.name}' is to the right of '{base.right.joint.name}'",
                help="exchange 'left' and 'right'",
                related=[Related(left.joint.span, "the wheel")],
            )
        for wheel in base.wheels:
            if wheel.axis[1] < 0.0:
                yield wheel_sides.at(
                    setting_span(robot, (component, wheel.setting.field)),
                    f"the axis of '{wheel.joint.name}' points to the right: its positive direction is backwards",
                    help="turn the axis round in the URDF; if it runs backwards then, change 'invert' of its actuator",
                    related=[Related(wheel.joint.axis_span or wheel.joint.span, "the axis")],
                )
