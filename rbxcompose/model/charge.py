"""What a robot's missions know of its driving and of its battery."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.tree import Comparison, Variable
from rbxcompose.geometry import Pose2
from rbxcompose.missions.analysis.facts import Constants, constants_of, number_in
from rbxcompose.missions.analysis.travel_times import Driving, Ways
from rbxcompose.missions.program.program import Interrupt, MissionNode
from rbxcompose.model.flow import MessageFlow
from rbxcompose.model.robot import Robot, RobotComponent, RobotMission
from rbxcompose.sdk.capabilities import Charges, CommandsMotion, Drains, Navigates


@dataclass(frozen=True, slots=True)
class ChargeInterrupt:
    """An interrupt that charges the battery when its level is below `level` (a ratio)."""

    interrupt: Interrupt
    reaction: tuple[MissionNode, ...]
    battery: RobotComponent
    drains: Drains
    charges: Charges
    level: float


def constants(mission: RobotMission) -> Constants:
    """Return the values of those `$names` of a mission that never change on this robot."""
    return constants_of(mission.program, mission.inputs)


def batteries(robot: Robot) -> dict[str, tuple[RobotComponent, Drains]]:
    """Return the values that are the level of a battery, each with that battery."""
    levels = {f"{component.name}.{one.level}": (component, one) for component, one in robot.declared(Drains)}
    entries = robot.manifest.values.items()
    return {name: levels[entry.port] for name, entry in entries if entry.port in levels}


def calls(robot: Robot, mission: RobotMission) -> Iterator[ChargeInterrupt]:
    """Yield the interrupts that charge when the battery is low."""
    known, constant = batteries(robot), constants(mission)
    for interrupt in mission.program.interrupts:
        match interrupt.when.expression.tree:
            case Comparison(operator="<" | "<=", left=Variable(name=name), right=limit) if name in known:
                level = number_in(limit, constant)
                reaction = () if interrupt.root is None else mission.program.below(interrupt.root)
                found = [charger for node in reaction if (charger := charger_of(robot, node.skill))]
                if level is not None and found:
                    yield ChargeInterrupt(interrupt, reaction, *known[name], found[0][1], level)


def charger_of(robot: Robot, skill: str) -> tuple[RobotComponent, Charges] | None:
    """Return the component at which a skill charges, None if it does not charge."""
    found = (one for one in robot.declared(Charges) if is_served(robot, skill, one[0], one[1].goals))
    return next(found, None)


def navigator_of(robot: Robot, skill: str) -> tuple[RobotComponent, Navigates] | None:
    """Return the component that drives to places as this skill, None if it does not drive."""
    found = (one for one in robot.declared(Navigates) if is_served(robot, skill, one[0], one[1].goals))
    return next(found, None)


def is_served(robot: Robot, skill: str, component: RobotComponent, port: str) -> bool:
    """Return whether a port of a component serves a skill."""
    source, end = robot.skills.get(skill), component.end(port)
    return source is not None and end is not None and end.topic == source.topic


def top_speed(robot: Robot, driver: RobotComponent, navigates: Navigates) -> float:
    """Return the highest speed at which the robot drives to a place [m/s], infinite if no limit is known."""
    limits = [navigates.max_speed, *(one.max_speed for one in driver.declared(CommandsMotion))]
    limits += [one.drives.max_speed for one in MessageFlow(robot).drives() if one.driver is driver]
    return min((limit.value for limit in limits if limit), default=math.inf)


def ways_of(robot: Robot, mission: RobotMission) -> Ways | None:
    """Return an empty record of the mission's ways; None if it drives with several skills."""
    used = {node.skill for node in mission.program.nodes if node.skill}
    found = [(skill, *one) for skill in sorted(used) if (one := navigator_of(robot, skill))]
    if not found:
        return Ways(mission.program, Driving("", "", 0.0, Pose2.distance), robot.manifest.places)
    if len(found) > 1:
        return None
    skill, driver, navigates = found[0]
    tolerance, least_time = navigates.tolerance, _least_time(robot, driver, navigates)
    driving = Driving(skill, robot.skills[skill].skill.main, tolerance.value if tolerance else 0.0, least_time)
    return Ways(mission.program, driving, robot.manifest.places)


def _least_time(robot: Robot, driver: RobotComponent, navigates: Navigates) -> Callable[[Pose2, Pose2], float]:
    """Return what tells the least time between two poses [s]: the driver itself, or the straight way at full speed."""
    if (own := navigates.least_time) is not None:
        base = next((one.drives for one in MessageFlow(robot).drives() if one.driver is driver), None)
        return lambda start, goal: own(start, goal, base)
    speed, tolerance = top_speed(robot, driver, navigates), navigates.tolerance
    free = 2 * tolerance.value if tolerance else 0.0  # from edge to edge of the tolerances
    return lambda start, goal: max(0.0, start.distance(goal) - free) / speed
