"""A battery that is empty before the dock is reached."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.far_place import far_places
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.facts import goal_place
from rbxcompose.missions.analysis.travel_times import too_short
from rbxcompose.model.blame import blamed
from rbxcompose.model.charge import calls, constants, ways_of
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.sdk.capabilities import Setting
from rbxcompose.units import RATIO, TIME, format_quantity

_LASTS = "how long a full battery lasts"


@check("RBX4124", Severity.WARNING)
def empty_on_the_way(robot: Robot) -> Iterator[Finding]:
    """The battery may be empty before the robot reaches its dock."""
    for mission in robot.missions.values():
        ways, known = ways_of(robot, mission), constants(mission)
        if ways is None:
            continue
        lost = {one.name for one in far_places(robot)}  # told as RBX3512
        list(too_short(ways, known))  # consumed for its side effect: it walks the whole mission
        for call in calls(robot, mission):
            goals = (
                goal_place(node, ways.driving.main, known, ways.places)
                for node in call.reaction
                if node.skill == ways.driving.skill
            )
            dock = next((place for place in goals if place), None)
            runtime = call.drains.runtime
            visited = [place for name, place in ways.visited.items() if name not in lost]
            if dock is None or runtime is None or not visited or dock.name in lost:
                continue
            far = max(visited, key=lambda place: ways.between(place, dock))
            lasts, needs = call.level * runtime.value, ways.between(far, dock)
            if runtime.value < needs:
                yield _never_there(robot, call.battery, runtime, f"from '{far.name}' to '{dock.name}'", needs)
            elif 0 <= lasts < needs:
                span, related = blamed(robot, mission, call.interrupt.when)
                yield empty_on_the_way.at(
                    span,
                    f"{format_quantity(call.level, RATIO)} last for {format_quantity(round(lasts, 1), TIME)}, but the "
                    f"way from '{far.name}' to '{dock.name}' takes {format_quantity(round(needs, 1), TIME)}",
                    help="interrupt earlier",
                    related=[*related, Related(setting_span(robot, (call.battery, runtime.field)), _LASTS)],
                )


def _never_there(robot: Robot, battery: RobotComponent, runtime: Setting[float], way: str, needs: float) -> Finding:
    """Return the finding about a battery that even when full is empty before the dock is reached."""
    lasts, takes = format_quantity(runtime.value, TIME), format_quantity(round(needs, 1), TIME)
    return empty_on_the_way.at(
        setting_span(robot, (battery, runtime.field)),
        f"a full battery lasts for {lasts}, but the way {way} takes {takes}",
        help=f"make it last longer: several times {takes}",
    )
