"""What a robot's missions know of its driving, its levels and conditions."""

import math
from collections.abc import Callable, Iterator

from rbxcompose.base.expressions.check import check_condition
from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.findings import Related, Span
from rbxcompose.base.geometry import Pose2
from rbxcompose.compiler.model.flow import MessageFlow
from rbxcompose.compiler.model.robot import Robot, RobotComponent, RobotMission
from rbxcompose.manifest.tree import at
from rbxcompose.missions.analysis.examined import NodeScope, base_scope, views
from rbxcompose.missions.analysis.facts import Bounds, Constants, constants_of, truth
from rbxcompose.missions.analysis.travel_times import Driving, Ways
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.program.parts import Asked
from rbxcompose.sdk.capabilities import CommandsMotion, Drains, Navigates


def constants(mission: RobotMission) -> Constants:
    """Return the values of those `$names` of a mission that never change on this robot."""
    return constants_of(mission.program, mission.inputs)


def batteries(robot: Robot) -> dict[str, tuple[RobotComponent, Drains]]:
    """Return the values that are the level of a battery, each with that battery."""
    levels = {f"{component.name}.{drains.level}": (component, drains) for component, drains in robot.declared(Drains)}
    entries = robot.manifest.values.items()
    return {name: levels[entry.port] for name, entry in entries if entry.port in levels}


def navigator_of(robot: Robot, skill: str) -> tuple[RobotComponent, Navigates] | None:
    """Return the component that drives to places as this skill, None if it does not drive."""
    found = (pair for pair in robot.declared(Navigates) if is_served(robot, skill, pair[0], pair[1].goals))
    return next(found, None)


def is_served(robot: Robot, skill: str, component: RobotComponent, port: str) -> bool:
    """Return whether a port of a component serves a skill."""
    source, end = robot.skills.get(skill), component.end(port)
    return source is not None and end is not None and end.topic == source.topic


def top_speed(robot: Robot, driver: RobotComponent, navigates: Navigates) -> float:
    """Return the highest speed at which the robot drives to a place [m/s], infinite if no limit is known."""
    limits = [navigates.max_speed, *(motion.max_speed for motion in driver.declared(CommandsMotion))]
    limits += [drive.drives.max_speed for drive in MessageFlow(robot).drives() if drive.driver is driver]
    return min((limit.value for limit in limits if limit), default=math.inf)


def ways_of(robot: Robot, mission: RobotMission) -> Ways | None:
    """Return an empty record of the mission's ways; None if it drives with several skills."""
    used = {node.skill for node in mission.program.nodes if node.skill}
    found = [(skill, *pair) for skill in sorted(used) if (pair := navigator_of(robot, skill))]
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
        base = next((drive.drives for drive in MessageFlow(robot).drives() if drive.driver is driver), None)
        return lambda start, goal: own(start, goal, base)
    speed, tolerance = top_speed(robot, driver, navigates), navigates.tolerance
    free = 2 * tolerance.value if tolerance else 0.0  # from edge to edge of the tolerances
    return lambda start, goal: max(0.0, start.distance(goal) - free) / speed


FULL = Bounds(0.0, 1.0)  # possible levels of a battery


def decided(robot: Robot, holds: bool) -> Iterator[tuple[Asked, Span, list[Related]]]:
    """Yield the conditions on the running robot that always hold, or never do, with the place that decides them.

    A condition that only compares written values is left out: it chooses between settings.
    """
    measured = {*robot.values, POSE}
    full = dict.fromkeys(batteries(robot), FULL)
    for mission in robot.missions.values():
        known = {name: Bounds(value, value) for name, value in constants(mission).items() if isinstance(value, float)}
        for asked, scope in _conditions(robot, mission):
            is_measured = any(name.name in measured for name in asked.expression.names)
            is_open = is_measured and not check_condition(asked.expression, scope)
            if is_open and truth(asked.expression.tree, known | full) is holds:
                yield asked, *blamed(robot, mission, asked)


def _conditions(robot: Robot, mission: RobotMission) -> Iterator[tuple[Asked, NodeScope]]:
    program, names = mission.program, robot.names
    for view in views(program, names):
        yield from ((asked, view.scope) for asked in view.node.asked if asked.wanted == FLAG)
    base = base_scope(program, names)
    yield from ((interrupt.when, base) for interrupt in program.interrupts)


def blamed(robot: Robot, mission: RobotMission, asked: Asked) -> tuple[Span, list[Related]]:
    """Return the place that decides a condition: the one input that it reads, else the condition itself."""
    inputs = {name.name for name in asked.expression.names} & mission.program.inputs.keys()
    if len(inputs) != 1:
        return asked.scalar.span, []
    [name] = inputs
    default = mission.program.inputs[name].default
    path = ("missions", mission.name, "with", name)
    if at(robot.manifest.root, path) is not None:
        return robot.value(*path), [Related(asked.scalar.span, "the condition")]
    return (default.span if default else asked.scalar.span), [Related(asked.scalar.span, "the condition")]
