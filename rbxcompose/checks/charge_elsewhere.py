"""Charging away from the dock."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.config import Place
from rbxcompose.findings import Finding, Related
from rbxcompose.missions.ways import distance, too_short
from rbxcompose.model.charging import CHARGER, constants, server, ways_of
from rbxcompose.model.flow import setting
from rbxcompose.model.robot import Robot


@check("RBX4130")
def charge_elsewhere(robot: Robot) -> Iterator[Finding]:
    """A mission charges where there is no dock

    The charger works at its `dock` only. Right before, the mission has driven to another place, which is out of reach.

    Bad:
    ```yaml
    do:
      - go_to: corner_1
      - recharge
    ```
    Good:
    ```yaml
    do:
      - go_to: dock
      - recharge
    ```
    """
    for mission in robot.missions.values():
        ways = ways_of(robot, mission)
        if ways is None:
            continue
        list(too_short(ways, constants(mission)))  # goes through all of the mission
        for number, here in ways.starts_at.items():
            node = mission.program.nodes[number]
            charger = server(robot, node.skill, CHARGER)
            dock = getattr(charger.config, "dock", None) if charger else None
            may_fail = node.may_be_left_out or node.is_forgiven
            if charger is None or not isinstance(dock, Place) or may_fail:
                continue
            reach = (setting(charger, "reach") or 0.0) + ways.driving.tolerance
            if distance(here, dock) > reach:
                yield charge_elsewhere.at(
                    node.span,
                    f"'{node.skill}' works at '{dock.name}' only, but here the robot is at '{here.name}'",
                    help=f"drive to the dock first: '{ways.driving.skill}: {dock.name}'",
                    related=[Related(robot.value(*charger.path, "dock"), "the dock of the charger")],
                )
