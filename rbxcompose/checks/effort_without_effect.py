"""A limit of the effort of a joint that cannot be kept."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.actuation.servo_models import model_named
from rbxcompose.actuation.torques import stall_torque
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.manifest.tree import value_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sections.actuators import actuators
from rbxcompose.sections.joints import joints


@check("RBX2241", Severity.WARNING, closed=(WIRING,))
def effort_without_effect(robot: Robot) -> Iterator[Finding]:
    """A limit of the effort that has no effect."""
    contents = robot.manifest.contents
    servos = contents.of(actuators)
    for name, one in contents.of(joints).items():
        for each in one.servos if one.limits.effort is not None else ():
            model = model_named(servos[each].model) if each in servos else None
            if model is not None and stall_torque(model) is None:
                yield effort_without_effect.at(
                    value_span(contents.root, ("joints", name, "limits", "effort")),
                    f"joint '{name}' has no limit of its effort: the stall torque of a {model.name} is not known",
                    help=f"limit the servo '{each}' by its share: 'torque: 50 %'",
                )
                break
