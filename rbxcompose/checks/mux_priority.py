"""Equal priorities in a mux."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot


@check("RBX3104")
def mux_priority(robot: Robot) -> Iterator[Finding]:
    """Two inputs of a mux have the same priority."""
    for mux, entry in robot.manifest.muxes.items():
        first: dict[int, str] = {}
        for name, priority in entry.ranks.items() if entry.profile == "default" else ():
            other = first.setdefault(priority, name)
            if other != name:
                yield mux_priority.at(
                    robot.value("muxes", mux, "inputs", name, "priority"),
                    f"two inputs of mux '{mux}' have the same priority {priority}",
                    label=f"input '{name}'",
                    help="the higher priority wins: give each input its own",
                    related=[Related(robot.value("muxes", mux, "inputs", other, "priority"), f"input '{other}'")],
                )
