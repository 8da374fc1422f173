"""A lock of a mux that never engages."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX3130")
def mux_heartbeat(robot: Robot) -> Iterator[Finding]:
    """A heartbeat of a mux has no timeout

    A lock engages when its heartbeat has been silent for its `timeout`. Only a lock whose `topic` carries a flag can do
    without one: it is engaged while the flag is true.

    Bad:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          teleop:
            priority: 100
            timeout: 0.5 s
        locks:
          door:
            priority: 200
    ```
    Good:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          teleop:
            priority: 100
            timeout: 0.5 s
        locks:
          door:
            priority: 200
            timeout: 0.3 s
    ```
    """
    for mux, entry in robot.manifest.muxes.items():
        for name, lock in entry.locks.items():
            if lock.timeout is None and lock.topic is None:
                yield mux_heartbeat.at(
                    robot.key("muxes", mux, "locks", name),
                    f"lock '{name}' of mux '{mux}' never engages: it has no timeout",
                    help="add 'timeout: 0.3 s', or the 'topic' of a flag",
                )
