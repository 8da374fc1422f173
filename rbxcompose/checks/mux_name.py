"""A name that a mux needs itself."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.mux.words import OWN_NAMES


@check("RBX3138")
def mux_name(robot: Robot) -> Iterator[Finding]:
    """An input or a lock of a mux has a name that the mux needs itself

    A mux tells who holds its output at `MUX/active`, or `MUX/selected` in the profile `topic_tools`. A mux whose inputs
    are selected has the services `select`, `add`, `delete` and `list` there. `output`, `announced`, and what begins
    with `lock_` are names of its other ports.

    Bad:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          active:
            priority: 100
            timeout: 0.5 s
    ```
    Good:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          teleop:
            priority: 100
            timeout: 0.5 s
    ```
    """
    for mux, entry in robot.manifest.muxes.items():
        names = [("inputs", name) for name in entry.inputs] + [("locks", name) for name in entry.locks]
        for key, name in names:
            if name in OWN_NAMES or name.startswith("lock_"):
                yield mux_name.at(
                    robot.key("muxes", mux, key, name),
                    f"mux '{mux}' needs the name '{name}' itself",
                    help="choose another name",
                )
