"""A rate of a bus at which one of its servos cannot listen."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.actuation.servo_models import COMMON_BAUDS
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.driven_joints import driven_buses
from rbxcompose.model.robot import Robot
from rbxcompose.sections.actuators import actuators, model_of
from rbxcompose.units import BIT_RATE, format_quantity


@check("RBX2227")
def baud_of_servo(robot: Robot) -> Iterator[Finding]:
    """A servo does not have the rate of its bus."""
    for bus in driven_buses(robot):
        contents = robot.manifest.contents
        own = {name: one for name, one in contents.of(actuators).items() if one.bus == bus.name}
        models = {name: model for name, one in own.items() if (model := model_of(contents, one))}
        deaf = [name for name, model in models.items() if model.code_of(bus.baud) is None]
        if deaf:
            names = sorted({models[name].name for name in deaf})
            common = [one for one in COMMON_BAUDS if all(model.code_of(one) is not None for model in models.values())]
            yield baud_of_servo.at(
                robot.value(*bus.path, "baud"),
                f"{' and '.join(names)} cannot listen at {format_quantity(bus.baud, BIT_RATE)}",
                help=f"rates that all servos of the bus have: {', '.join(map(str, common))}",
                related=[Related(robot.key("actuators", deaf[0]), f"'{deaf[0]}' is one of them")],
            )
