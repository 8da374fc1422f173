"""A mux input that stays live long after its source fell silent."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.qos import Qos
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.ports import In
from rbxcompose.units import TIME, format_quantity

LONGEST = 60.0  # [s]: commands come many times a second


@check("RBX3108", Severity.WARNING, closed=(WIRING, NAMES))
def long_timeout(robot: Robot) -> Iterator[Finding]:
    """An input of a mux stays live long after its source fell silent."""
    for mux, entry in robot.manifest.muxes.items():
        for name, one in entry.inputs.items():
            end = robot.components[mux].end(name)
            timeout = one.timeout or 0.0
            if end and isinstance(end.port, In) and end.port.qos is Qos.COMMAND and timeout > LONGEST:
                yield long_timeout.at(
                    robot.value("muxes", mux, "inputs", name, "timeout"),
                    f"input '{name}' of mux '{mux}' stays live for {format_quantity(timeout, TIME)} after its last "
                    "command",
                    help="a few times the time between two commands is enough, such as '0.5 s'",
                )
