"""A name that a mux needs itself."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.mux.words import OWN_NAMES


@check("RBX3138")
def mux_name(robot: Robot) -> Iterator[Finding]:
    """An input or a lock of a mux has a name that the mux needs itself."""
    for mux, entry in robot.manifest.muxes.items():
        names = [("inputs", name) for name in entry.inputs] + [("locks", name) for name in entry.locks]
        for key, name in names:
            if name in OWN_NAMES or name.startswith("lock_"):
                yield mux_name.at(
                    robot.key("muxes", mux, key, name),
                    f"mux '{mux}' needs the name '{name}' itself",
                    help="choose another name",
                )
