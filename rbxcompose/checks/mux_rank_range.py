"""A priority that twist_mux does not have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.mux.words import HIGHEST


@check("RBX3134", Severity.WARNING)
def mux_rank_range(robot: Robot) -> Iterator[Finding]:
    """A priority beyond those of the profile `twist_mux`."""
    for mux, entry in robot.manifest.muxes.items():
        if entry.profile != "twist_mux":
            continue
        for name, rank in entry.ranks.items():
            if not 0 < rank <= HIGHEST:
                effect = f"counts as {HIGHEST}" if rank > 0 else "never gets through"
                yield mux_rank_range.at(
                    robot.value("muxes", mux, "inputs", name, "priority"),
                    f"input '{name}' of mux '{mux}' {effect}: its priority is {rank}",
                    help=f"give it a priority from 1 to {HIGHEST}",
                )
