"""A lock that blocks no input."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot


@check("RBX3105")
def idle_lock(robot: Robot) -> Iterator[Finding]:
    """A lock of a mux blocks no input."""
    for mux, entry in robot.manifest.muxes.items():
        ranks = entry.ranks
        lowest = min(ranks, key=lambda name: ranks[name], default="")
        for name, priority in entry.lock_ranks.items():
            if lowest and priority <= ranks[lowest]:
                yield idle_lock.at(
                    robot.value("muxes", mux, "locks", name, "priority"),
                    f"lock '{name}' of mux '{mux}' holds back no input: none has a priority below {priority}",
                    help="give it a higher priority than the inputs that it should hold back",
                    related=[Related(robot.value("muxes", mux, "inputs", lowest, "priority"), "the lowest input")],
                )
