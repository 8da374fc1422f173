"""Equal priorities in a profile that knows what to do with them."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX3137", Severity.WARNING)
def mux_same_rank(robot: Robot) -> Iterator[Finding]:
    """Two inputs of a mux have the same priority, and the one that holds it keeps it."""
    for mux, entry in robot.manifest.muxes.items():
        first: dict[int, str] = {}
        for name, rank in entry.ranks.items() if entry.profile == "yocs" else ():
            other = first.setdefault(rank, name)
            if other != name:
                yield mux_same_rank.at(
                    robot.value("muxes", mux, "inputs", name, "priority"),
                    f"inputs '{other}' and '{name}' of mux '{mux}' have the same priority {rank}: who holds keeps it",
                    help="give each input its own priority",
                    related=[Related(robot.value("muxes", mux, "inputs", other, "priority"), f"input '{other}'")],
                )
