"""A mux that takes from a mux, or from itself."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot


@check("RBX3111")
def mux_of_mux(robot: Robot) -> Iterator[Finding]:
    """An input of a mux takes from a mux."""
    muxes = robot.manifest.muxes
    for mux, entry in muxes.items():
        for name, one in entry.inputs.items():
            source = mux if one.topic == mux else (one.source or "").partition(".")[0]
            if source not in muxes:
                continue
            is_loop = source == mux
            message = "takes its own output" if is_loop else f"takes from the mux '{source}'"
            inputs = ", ".join(f"'{each}'" for each in muxes[source].inputs)
            yield mux_of_mux.at(
                robot.value("muxes", mux, "inputs", name, "topic" if one.topic == mux else "from"),
                f"input '{name}' of mux '{mux}' {message}",
                help="remove this input" if is_loop else f"give this mux the inputs of that one: {inputs}",
                related=[Related(robot.key("muxes", source), "the mux that it takes from")],
            )
