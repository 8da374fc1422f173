"""A mux that selects first what it does not have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, correction, suggest
from rbxcompose.model.robot import Robot
from rbxcompose.mux.requests import NONE


@check("RBX3132", is_fixable=True)
def mux_initial(robot: Robot) -> Iterator[Finding]:
    """What a mux selects first is not one of its inputs."""
    for mux, entry in robot.manifest.muxes.items():
        if entry.works_by == "select" and entry.initial is not None and entry.initial not in (NONE, *entry.inputs):
            span = robot.value("muxes", mux, "initial")
            yield mux_initial.at(
                span,
                f"mux '{mux}' has no input '{entry.initial}'",
                help=suggest(entry.initial, [*entry.inputs, NONE], "inputs"),
                fix=correction(entry.initial, entry.inputs, span),
            )
