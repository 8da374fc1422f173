"""Servos of one bus that need other voltages."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.driven_joints import driven_buses
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sections.actuators import actuators, model_of


@check("RBX2242", Severity.WARNING, closed=(WIRING,))
def supply_voltage(robot: Robot) -> Iterator[Finding]:
    """Servos on one bus need different voltages."""
    for bus in driven_buses(robot):
        contents = robot.manifest.contents
        own = {name: one for name, one in contents.of(actuators).items() if one.bus == bus.name}
        models = {name: model for name, one in own.items() if (model := model_of(contents, one))}
        if not models:
            continue
        strong = max(models, key=lambda name: models[name].volts[0])
        weak = min(models, key=lambda name: models[name].volts[1])
        (least, _), (_, most) = models[strong].volts, models[weak].volts
        if most < least:
            late = max(strong, weak, key=list(models).index)
            yield supply_voltage.at(
                robot.value("actuators", late, "model"),
                f"'{weak}' ({models[weak].name}) takes at most {most:g} V, and '{strong}' ({models[strong].name}) "
                f"at least {least:g} V, on the one cable of bus '{bus.name}'",
                help="put them on two buses, each with its own supply",
                related=[Related(robot.value("actuators", strong if late == weak else weak, "model"), "the other")],
            )
