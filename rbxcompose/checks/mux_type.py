"""A mux input whose type differs from that of the mux."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING


@check("RBX3107", closed=(WIRING,))
def mux_type(robot: Robot) -> Iterator[Finding]:
    """A mux input takes an output of another type."""
    for mux, entry in robot.manifest.muxes.items():
        for name, one in entry.inputs.items():
            own = robot.components[mux].end(name)
            component = (one.source or "").partition(".")[0]
            for writer in robot.writers.get(own.topic, ()) if own else ():
                if own and writer.instance == component and writer.type_name != own.type_name:
                    yield mux_type.at(
                        robot.value("muxes", mux, "inputs", name, "from"),
                        f"input '{name}' of mux '{mux}' takes {writer.type_name}, but the mux forwards {own.type_name}",
                        help=f"take an output of type {own.type_name}",
                        related=[Related(robot.component_span(component), "the source")],
                    )
