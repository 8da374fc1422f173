"""A bus whose cycle is shorter than what its servos have to say."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.actuation.bus_load import BusLoad, cycle_load
from rbxcompose.actuation.groups import FACTORY_DELAY
from rbxcompose.actuation.servo_models import COMMON_BAUDS
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.manifest.tree import at
from rbxcompose.model.driven_joints import DrivenBus, driven_buses
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.units import BIT_RATE, FREQUENCY, TIME, format_quantity


@check("RBX2226", Severity.WARNING, closed=(WIRING,))
def slow_bus(robot: Robot) -> Iterator[Finding]:
    """A cycle of a bus does not fit into its period."""
    for bus in driven_buses(robot):
        delay = FACTORY_DELAY if bus.delay is None else bus.delay
        load, period = cycle_load(bus.servos), 1.0 / bus.rate
        taken = load.time(bus.baud, delay)
        if taken <= period:
            continue
        written = next((key for key in ("rate", "baud") if at(robot.manifest.root, (*bus.path, key))), None)
        pauses = f"{load.replies} pauses of {format_quantity(delay, TIME, 'us')}" if delay else "no pauses"
        yield slow_bus.at(
            robot.value(*bus.path, written) if written else robot.key(*bus.path),
            f"a cycle of the bus '{bus.name}' takes {_ms(taken)} at {format_quantity(bus.baud, BIT_RATE)}, and "
            f"{format_quantity(bus.rate, FREQUENCY)} leave {_ms(period)}",
            label=f"{len(bus.servos)} servos: {load.length} B and {pauses}",
            help=f"what would fit: {', or '.join(_cures(bus, load, delay))}",
        )


def _ms(time: float) -> str:
    return format_quantity(round(time, 5), TIME, "ms")


def _cures(bus: DrivenBus, load: BusLoad, delay: float) -> Iterator[str]:
    """Yield single changes that make the cycle fit."""
    possible = 1.0 / load.time(bus.baud, delay)
    yield f"'rate: {math.floor(possible) if possible >= 1.0 else round(possible, 2)} Hz'"
    needed, without = (load.baud_for(1.0 / bus.rate, one) for one in (delay, 0.0))
    if delay and without <= bus.baud:
        yield "'return_delay: 0 s'"
    if faster := _least(bus, needed):
        yield f"'baud: {faster}'"
    elif without > bus.baud and (faster := _least(bus, without)):
        yield f"'baud: {faster}' with 'return_delay: 0 s'"


def _least(bus: DrivenBus, needed: float) -> int | None:
    """Return the least rate that all servos have and that is enough [bit/s]."""
    models = [model for model, _ in bus.servos.values()]
    enough = (one for one in COMMON_BAUDS if one >= needed)
    return next((one for one in enough if all(model.code_of(one) is not None for model in models)), None)
