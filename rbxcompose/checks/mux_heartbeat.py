"""A lock of a mux that never engages."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX3130")
def mux_heartbeat(robot: Robot) -> Iterator[Finding]:
    """A heartbeat of a mux has no timeout."""
    for mux, entry in robot.manifest.muxes.items():
        for name, lock in entry.locks.items():
            if lock.timeout is None and lock.topic is None:
                yield mux_heartbeat.at(
                    robot.key("muxes", mux, "locks", name),
                    f"lock '{name}' of mux '{mux}' never engages: it has no timeout",
                    help="add 'timeout: 0.3 s', or the 'topic' of a flag",
                )
