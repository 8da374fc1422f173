"""Rounds that begin more often than they can end."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.facts import place_in_text
from rbxcompose.missions.analysis.travel_times import too_short
from rbxcompose.model.charge import constants, ways_of
from rbxcompose.model.robot import Robot
from rbxcompose.units import TIME, format_quantity


@check("RBX4168", Severity.WARNING)
def hurried_rounds(robot: Robot) -> Iterator[Finding]:
    """The rounds of a loop take longer than the time between their starts."""
    for mission in robot.missions.values():
        if (ways := ways_of(robot, mission)) is None:
            continue
        list(too_short(ways, constants(mission)))  # consumed for its side effect: it walks the whole mission
        for one in ways.late.values():
            takes, given = (format_quantity(round(time, 2), TIME) for time in (one.needs, one.given))
            yield hurried_rounds.at(
                place_in_text(one.node, one.node.step.lasts),
                f"each round takes at least {takes}, but one is to begin every {given}",
                help=f"make it longer than {takes}, or remove it",
            )
