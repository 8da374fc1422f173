"""A limit of the effort of a joint that its servos do not reach."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.manifest.tree import value_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sections.actuators import actuators
from rbxcompose.sections.joints import effort_of, joints
from rbxcompose.units import format_quantity

ROUNDING = 1e-3  # of an effort


@check("RBX2240", Severity.WARNING, closed=(WIRING,))
def effort_out_of_reach(robot: Robot) -> Iterator[Finding]:
    """A limit of the effort that servos do not reach."""
    contents = robot.manifest.contents
    servos = contents.of(actuators)
    for name, one in contents.of(joints).items():
        limit, most = one.limits.effort, effort_of(one, [servos[each] for each in one.servos if each in servos])
        if limit is not None and most is not None and limit.value > most * (1.0 + ROUNDING):
            wanted, can = format_quantity(limit.value, limit.dimension), format_quantity(most, limit.dimension)
            yield effort_out_of_reach.at(
                value_span(contents.root, ("joints", name, "limits", "effort")),
                f"joint '{name}' is limited to {wanted}, and its servos exert {can} at most",
            )
