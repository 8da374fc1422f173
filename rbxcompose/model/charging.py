"""What a robot's missions know of its driving and of its battery."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from rbxcompose.expressions.tree import Comparison, Variable
from rbxcompose.missions.facts import Constants, constants_of, number_in
from rbxcompose.missions.program import Interrupt, Node
from rbxcompose.missions.ways import Driving, Ways
from rbxcompose.model.flow import Flow, setting
from rbxcompose.model.robot import Part, Robot, RobotMission
from rbxcompose.sdk.ports import ServesAction

LEVEL = "battery_level"
GO_TO, CHARGER, BATTERY = "go_to", "charger", "battery_sim"  # types whose ways are known here


@dataclass(frozen=True, slots=True)
class Call:
    """An interrupt that charges the battery when its level is below `level` (a ratio)."""

    interrupt: Interrupt
    reaction: tuple[Node, ...]
    battery: Part
    level: float


def constants(mission: RobotMission) -> Constants:
    """Return what the `$names` of a mission stand for on this robot, where that never changes."""
    return constants_of(mission.program, mission.inputs)


def batteries(robot: Robot) -> dict[str, Part]:
    """Return the values that are the level of a battery, each with that battery."""
    found = {}
    for name, entry in robot.manifest.values.items():
        component, _, port = (entry.port or "").partition(".")
        part = robot.parts.get(component)
        if part is not None and part.type_name == BATTERY and port == LEVEL:
            found[name] = part
    return found


def calls(robot: Robot, mission: RobotMission) -> Iterator[Call]:
    """Yield the interrupts that charge when the battery is low."""
    known, constant = batteries(robot), constants(mission)
    for interrupt in mission.program.interrupts:
        match interrupt.when.expression.tree:
            case Comparison(operator="<" | "<=", left=Variable(name=name), right=limit) if name in known:
                level = number_in(limit, constant)
                reaction = () if interrupt.root is None else mission.program.below(interrupt.root)
                if level is not None and any(server(robot, node.skill, CHARGER) for node in reaction):
                    yield Call(interrupt, reaction, known[name], level)


def server(robot: Robot, skill: str, type_name: str) -> Part | None:
    """Return the part that serves a skill, if it is of that type."""
    source = robot.skills.get(skill)
    for part in robot.parts.values() if source else ():
        if part.type_name == type_name and any(
            isinstance(end.port, ServesAction) and source and end.topic == source.topic for end in part.ends
        ):
            return part
    return None


def ways_of(robot: Robot, mission: RobotMission) -> Ways | None:
    """Return an empty account of the mission's ways; None if it drives by several skills."""
    used = {node.skill for node in mission.program.nodes if node.skill}
    found = [(skill, part) for skill in sorted(used) if (part := server(robot, skill, GO_TO))]
    if not found:
        return Ways(mission.program, Driving("", "", 1.0, 0.0), robot.manifest.places)
    if len(found) > 1:
        return None
    skill, driver = found[0]
    parts = [driver, *(base for one, base in Flow(robot).drives() if one is driver)]
    speed = min(limit for part in parts for name in ("speed", "max_speed") if (limit := setting(part, name)))
    driving = Driving(skill, robot.skills[skill].skill.main, speed, setting(driver, "tolerance") or 0.0)
    return Ways(mission.program, driving, robot.manifest.places)
