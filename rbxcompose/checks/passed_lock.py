"""A lock of a mux that lets the robot drive by itself."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX3110", Severity.WARNING)
def passed_lock(robot: Robot) -> Iterator[Finding]:
    """A lock of a mux does not hold back a component that drives

    A silent lock holds back the inputs with a lower priority than its own. A person at an open input, such as a
    joystick, may be above it. An input `from` a component above it drives by itself, whatever the lock guards.

    Bad:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          teleop:
            priority: 10
            timeout: 0.5 s
          navigation:
            from: go_to
            priority: 50
            timeout: 0.5 s
        locks:
          door:
            priority: 20
            timeout: 0.3 s
    ```
    Good:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          teleop:
            priority: 100
            timeout: 0.5 s
          navigation:
            from: go_to
            priority: 10
            timeout: 0.5 s
        locks:
          door:
            priority: 20
            timeout: 0.3 s
    ```
    """
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
