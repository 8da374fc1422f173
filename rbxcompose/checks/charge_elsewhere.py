"""Charging away from the dock."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.missions.analysis.travel_times import distance, too_short
from rbxcompose.model.charge import charger_of, constants, ways_of
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING


@check("RBX4130", closed=(WIRING, "places"))
def charge_elsewhere(robot: Robot) -> Iterator[Finding]:
    """A mission charges where there is no dock."""
    for mission in robot.missions.values():
        ways = ways_of(robot, mission)
        if ways is None:
            continue
        list(too_short(ways, constants(mission)))  # consumed for its side effect: it walks the whole mission
        for number, here in ways.starts_at.items():
            node = mission.program.nodes[number]
            charger, charges = charger_of(robot, node.skill) or (None, None)
            may_fail = node.may_be_left_out or node.is_forgiven
            if charger is None or charges is None or charges.place is None or may_fail:
                continue
            dock = charges.place.value
            reach = charges.reach.value if charges.reach else 0.0
            if distance(here, dock) > reach + ways.driving.tolerance:
                yield charge_elsewhere.at(
                    node.span,
                    f"'{node.skill}' works only at '{dock.name}', but here the robot is at '{here.name}'",
                    help=f"drive to the dock first: '{ways.driving.skill}: {dock.name}'",
                    related=[Related(setting_span(robot, (charger, charges.place.field)), "the dock of the charger")],
                )
