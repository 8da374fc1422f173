"""A mux input or lock without a priority or a timeout."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.sections.muxes import MuxModel


@check("RBX3130")
def mux_rank(robot: Robot) -> Iterator[Finding]:
    """An input or a lock of a mux lacks its priority or its timeout

    In the mode `priority`, the priority decides who gets through, and the timeout when a silent source lets go. In the
    mode `latest` only the timeout does. A selected input holds the output until another one is selected, so it needs
    neither. A lock without a timeout would never engage, unless its `topic` carries a flag.

    Bad:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          teleop:
            priority: 100
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
        for kind, name, lacking in _lacking(entry):
            yield mux_rank.at(
                robot.key("muxes", mux, kind, name),
                f"{kind[:-1]} '{name}' of mux '{mux}' has no {lacking}",
                help="add 'priority: 10'" if lacking == "priority" else "add 'timeout: 0.5 s'",
            )


def _lacking(entry: MuxModel) -> Iterator[tuple[str, str, str]]:
    """Yield the keys of inputs and locks, their names, and what they lack."""
    for name, one in entry.inputs.items():
        if entry.has_priorities and one.priority is None:
            yield "inputs", name, "priority"
        if entry.works_by != "select" and one.timeout is None:
            yield "inputs", name, "timeout"
    for name, lock in entry.locks.items():
        if entry.has_priorities and lock.priority is None:
            yield "locks", name, "priority"
        if not lock.timeout and lock.topic is None:
            yield "locks", name, "timeout"
