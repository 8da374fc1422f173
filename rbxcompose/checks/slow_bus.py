"""A bus whose cycle is shorter than what its servos have to say."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.actuation.bus_load import BusLoad, cycle_load
from rbxcompose.actuation.groups import FACTORY_DELAY
from rbxcompose.actuation.servo_models import COMMON_BAUDS, ServoModel, model_named
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.manifest.tree import at
from rbxcompose.model.driven_joints import buses_of
from rbxcompose.model.robot import Robot
from rbxcompose.servo_bus_config import ServoBusConfig
from rbxcompose.units import BIT_RATE, FREQUENCY, TIME, format_quantity


@check("RBX2226", Severity.WARNING)
def slow_bus(robot: Robot) -> Iterator[Finding]:
    """A cycle of a bus does not fit into its period

    In each cycle all servos are read and written. Each byte takes ten bits on the wire, and each reply comes after the
    return delay of its servo, which is 500 us as they are sold; AX and RX servos are asked one by one. The bus then
    skips periods, so joints move in coarser steps than `rate` promises. A USB adapter adds its own latency to each
    request. Simulated servos are not slower for it, unless they are simulated with `sim: pty`.

    Bad: `servos: {type: dynamixel, baud: 57600, rate: 100 Hz}` with six AX-12.
    Good: `servos: {type: dynamixel, baud: 1000000, rate: 100 Hz}`
    """
    for bus, path in buses_of(robot):
        delay = FACTORY_DELAY if bus.return_delay is None else bus.return_delay
        servos = {
            servo.id: (model, joint.mode)
            for joint in bus.joints.values()
            for servo in joint.servos
            if (model := model_named(servo.model))
        }
        load, period = cycle_load(servos), 1.0 / bus.rate
        taken = load.time(bus.baud, delay)
        if taken <= period:
            continue
        written = next((key for key in ("rate", "baud") if at(robot.manifest.root, (*path, key))), None)
        pauses = f"{load.replies} pauses of {format_quantity(delay, TIME, 'us')}" if delay else "no pauses"
        yield slow_bus.at(
            robot.value(*path, written) if written else robot.key(*path),
            f"a cycle of the bus '{bus.name}' takes {_ms(taken)} at {format_quantity(bus.baud, BIT_RATE)}, and "
            f"{format_quantity(bus.rate, FREQUENCY)} leave {_ms(period)}",
            label=f"{len(servos)} servos: {load.length} B and {pauses}",
            help=f"what would fit: {', or '.join(_cures(bus, load, delay, [model for model, _ in servos.values()]))}",
        )


def _ms(time: float) -> str:
    return format_quantity(round(time, 5), TIME, "ms")


def _cures(bus: ServoBusConfig, load: BusLoad, delay: float, models: list[ServoModel]) -> Iterator[str]:
    """Yield single changes that make the cycle fit."""
    period, possible = 1.0 / bus.rate, 1.0 / load.time(bus.baud, delay)
    yield f"'rate: {math.floor(possible) if possible >= 1.0 else round(possible, 2)} Hz'"
    needed = load.baud_for(period, delay)
    if delay and load.time(bus.baud, 0.0) <= period:
        yield "'return_delay: 0 s'"
    elif delay and math.isinf(needed):
        needed = load.baud_for(period, 0.0)
        if baud := _least(models, needed):
            yield f"'baud: {baud}' with 'return_delay: 0 s'"
        return
    if baud := _least(models, needed):
        yield f"'baud: {baud}'"


def _least(models: list[ServoModel], needed: float) -> int | None:
    return next(
        (one for one in COMMON_BAUDS if one >= needed and all(each.code_of(one) is not None for each in models)), None
    )
