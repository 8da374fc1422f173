"""A lock of a mux that lets the robot drive by itself."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX3110", Severity.WARNING)
def passed_lock(robot: Robot) -> Iterator[Finding]:
    """A lock of a mux does not hold back a component that drives."""
    for mux, entry in robot.manifest.muxes.items():
        ranks = entry.ranks
        for name, priority in entry.lock_ranks.items():
            above = [key for key, rank in ranks.items() if entry.inputs[key].source and rank >= priority]
            if above and min(ranks.values()) < priority:  # otherwise it holds back nothing at all
                yield passed_lock.at(
                    robot.value("muxes", mux, "locks", name, "priority"),
                    f"lock '{name}' of mux '{mux}' does not hold back '{above[0]}', which drives by itself",
                    help=f"give it a priority above {max(ranks[one] for one in above)}",
                    related=[
                        Related(robot.value("muxes", mux, "inputs", one, "priority"), f"input '{one}'") for one in above
                    ],
                )
