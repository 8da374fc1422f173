"""A base whose wheels are others than those of the body."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.base_wheels import differs, rolling_bases
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.units import LENGTH, format_quantity


@check("RBX2281", Severity.WARNING, closed=(WIRING,))
def wheels_of_body(robot: Robot) -> Iterator[Finding]:
    """The wheels of a base are others than those of its body."""
    for base in rolling_bases(robot):
        rolls, left = base.rolls, base.left
        lengths = [("wheels are %s apart", rolls.wheel_distance, abs(base.wheel_distance))]
        if rolls.wheel_radius and left.radius is not None:
            lengths.append(("wheels have a radius of %s", rolls.wheel_radius, left.radius))
        for words, setting, length in lengths:
            if differs(setting, length):
                wanted, there = format_quantity(setting.value, LENGTH), format_quantity(length, LENGTH)
                yield wheels_of_body.at(
                    setting_span(robot, (base.component, setting.field)),
                    f"the {words % wanted}, in the body {there}",
                    help="measure them, and correct the one that is wrong",
                    related=[Related(left.joint.span, "the left wheel")],
                )
