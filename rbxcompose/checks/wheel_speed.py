"""A base that is faster than its wheels."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.base_wheels import BodyWheel, rolling_bases
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import Drives, Setting
from rbxcompose.sections.joints import joints
from rbxcompose.units import ANGULAR_SPEED, SPEED, Dimension, format_quantity

ROUNDING = 1e-3  # of a speed


@check("RBX2283", Severity.WARNING, closed=(WIRING,))
def wheel_speed(robot: Robot) -> Iterator[Finding]:
    """A base is to be faster than its wheels can turn."""
    for base in rolling_bases(robot):
        rolls, slowest = base.rolls, min(base.wheels, key=lambda one: _limit(robot, one))
        limit = _limit(robot, slowest)
        if rolls.wheel_radius is None or math.isinf(limit) or base.has_other_radius:
            continue  # with the right radius, which RBX2281 asks for, the speeds are others, too
        fastest = limit * rolls.wheel_radius.value
        for drives in base.component.declared(Drives):
            rate = fastest / (rolls.wheel_distance.value / 2.0)
            speeds: list[tuple[Setting[float] | None, float, Dimension]] = [
                (drives.max_speed, fastest, SPEED),
                (drives.max_turn_rate, rate, ANGULAR_SPEED),
            ]
            for setting, most, dimension in speeds:
                if setting and setting.value > most * (1.0 + ROUNDING):
                    wanted, can = format_quantity(setting.value, dimension), format_quantity(most, dimension)
                    turning = format_quantity(limit, ANGULAR_SPEED)
                    yield wheel_speed.at(
                        setting_span(robot, (base.component, setting.field)),
                        f"it is to reach {wanted}, and its wheels, which turn at {turning} at most, reach {can}",
                        help=f"make it at most {can}",
                        related=[Related(slowest.joint.span, "the wheel")],
                    )


def _limit(robot: Robot, wheel: BodyWheel) -> float:
    """Return how fast a wheel may turn [rad/s], infinite if nothing limits it."""
    driven, limits = robot.manifest.contents.of(joints).get(wheel.joint.name), wheel.joint.limits
    own = driven.limits.velocity.value if driven and driven.limits.velocity else math.inf
    return min(own, limits.velocity if limits and limits.velocity is not None else math.inf)
