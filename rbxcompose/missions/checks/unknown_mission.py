"""Missions that the robot does not have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.findings import DID_YOU_MEAN, MOST_NAMES, Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.printable import plain
from rbxcompose.references import MISSION


@mission_check("RBX4144", is_fixable=True)
def unknown_mission(mission: Examined) -> Iterator[Finding]:
    """A mission uses another one that the robot does not have."""
    missions = mission.robot.missions
    for node in mission.program.nodes:
        used = node.step.uses
        name = used.text if used else ""
        known = name in missions or name in mission.robot.unread or mission.robot.may_have(MISSION, name)
        if used and name and not known:
            message = f"the robot has no mission '{name}'"
            found = unknown_mission.misspelt(used.span, message, name, missions, "missions of this robot")
            listed = f"list it under 'missions' of the robot, '{plain(name, 60)}: FILE', or use one of them"
            is_near = found.help.startswith(DID_YOU_MEAN)
            yield found if is_near else replace(found, help=f"{listed}: {', '.join(list(missions)[:MOST_NAMES])}")
