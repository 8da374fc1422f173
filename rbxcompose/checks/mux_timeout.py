"""A mux input that times out between two messages."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import period_of
from rbxcompose.model.robot import Robot
from rbxcompose.units import TIME, format_quantity


@check("RBX3101")
def mux_timeout(robot: Robot) -> Iterator[Finding]:
    """An input of a mux times out between two of its messages."""
    for mux, entry in robot.manifest.muxes.items():
        for name, source in entry.inputs.items():
            component = robot.components.get((source.source or "").partition(".")[0])
            period = period_of(component) if component else None
            if component and period is not None and source.timeout and source.timeout < 2 * period - 1e-9:
                when = "before" if source.timeout <= period else "if one message is late, before"
                yield mux_timeout.at(
                    robot.value("muxes", mux, "inputs", name, "timeout"),
                    f"input '{name}' of mux '{mux}' times out {when} '{component.name}' sends its next message",
                    label=f"it sends every {format_quantity(period, TIME)}",
                    help=f"make it several times as long: '{format_quantity(10 * period, TIME)}'",
                    related=[Related(robot.component_span(component.name), "the source")],
                )
