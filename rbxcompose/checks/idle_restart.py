"""Limits of restarts that never happen."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.manifest.tree import at
from rbxcompose.model.robot import Robot

_LIMITS = ("max", "within", "backoff")


@check("RBX3508", Severity.WARNING, closed=())
def idle_restart(robot: Robot) -> Iterator[Finding]:
    """A limit of restarts that never happen."""
    for component in robot.components.values():
        path = (*component.path, "restart")
        if component.restart.when != "never" or at(robot.manifest.root, path) is None:
            continue
        for key in _LIMITS:
            if at(robot.manifest.root, (*path, key)) is not None:
                message = f"'{key}' changes nothing: '{component.name}' is never restarted"
                yield idle_restart.at(
                    robot.key(*path, key), message, help=f"write 'when: on_failure', or remove '{key}'"
                )
