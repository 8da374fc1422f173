"""Wheels that go on turning when this machine fails."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.driven_joints import BUSES
from rbxcompose.model.robot import Robot


@check("RBX2243", Severity.WARNING, closed=())
def no_watchdog(robot: Robot) -> Iterator[Finding]:
    """Servos that turn wheels have no watchdog."""
    for component in robot.components.values():
        bus: Any = component.config
        if component.path[:1] == BUSES and component.is_sound and not bus.watchdog:
            turned = [name for name, joint in bus.joints.items() if joint.mode == "velocity"]
            if turned:
                yield no_watchdog.at(
                    robot.value(*component.path, "watchdog"),
                    f"when this machine fails, the servo of '{turned[0]}' goes on turning: its bus has no watchdog",
                    help="write 'watchdog: 0.2 s', or leave it out",
                )
