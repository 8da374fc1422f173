"""A lock of a mux that engages between two heartbeats."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import period_of
from rbxcompose.model.robot import Robot
from rbxcompose.units import TIME, format_quantity


@check("RBX3109")
def lock_timeout(robot: Robot) -> Iterator[Finding]:
    """A lock of a mux engages between two of its heartbeats."""
    for mux, entry in robot.manifest.muxes.items():
        for name, lock in entry.locks.items():
            end = robot.components[mux].end(f"lock_{name}") if mux in robot.components else None
            for writer in robot.writers.get(end.topic, ()) if end else ():
                period = period_of(robot.components[writer.instance])
                if period is not None and lock.timeout and lock.timeout < 2 * period - 1e-9:
                    when = "before" if lock.timeout <= period else "if one is late, before"
                    yield lock_timeout.at(
                        robot.value("muxes", mux, "locks", name, "timeout"),
                        f"lock '{name}' of mux '{mux}' engages {when} '{writer.instance}' sends its next heartbeat",
                        label=f"it sends every {format_quantity(period, TIME)}",
                        help=f"make it several times as long: '{format_quantity(10 * period, TIME)}'",
                        related=[Related(robot.component_span(writer.instance), "the source")],
                    )
