"""A reaction to an empty battery that does not charge at the dock."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import Comparison, Variable
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.facts import goal_place
from rbxcompose.missions.program.answers import NodeFlow
from rbxcompose.missions.program.program import Interrupt, MissionNode
from rbxcompose.model.charge import batteries, charger_of, constants, navigator_of
from rbxcompose.model.robot import Robot, RobotMission
from rbxcompose.rules import MISSIONS, WIRING
from rbxcompose.sdk.capabilities import Charges


@check("RBX4173", Severity.WARNING, closed=(WIRING, MISSIONS))
def dock_without_charge(robot: Robot) -> Iterator[Finding]:
    """A reaction to a low battery does not charge at the dock."""
    levels = batteries(robot)
    for mission in robot.missions.values():
        for interrupt in mission.program.interrupts:
            match interrupt.when.expression.tree:
                case Comparison(operator="<" | "<=", left=Variable(name=name)) if name in levels:
                    yield from _of_reaction(robot, mission, interrupt)


def _of_reaction(robot: Robot, mission: RobotMission, interrupt: Interrupt) -> Iterator[Finding]:
    nodes = mission.program.nodes
    root = nodes[interrupt.root] if interrupt.root is not None else None
    steps = [nodes[one] for one in root.children] if root and root.step.flow is NodeFlow.IN_TURN else []
    if root is None or any(one.children or not one.skill for one in steps):
        return  # more than drives and charges, one after the other
    drives = [one for one in steps if navigator_of(robot, one.skill)]
    docks = [one for one in drives if _is_dock(robot, mission, one)]
    charges = [one for one in steps if charger_of(robot, one.skill)]
    if docks and charges and charges[0].number < drives[0].number:
        message = f"'{interrupt.name}' charges before it drives to the dock"
        related = [Related(docks[0].span, "it drives there only now")]
        yield dock_without_charge.at(charges[0].span, message, help="exchange these steps", related=related)
    elif docks and docks[-1] is steps[-1] and not any(charger_of(robot, one.skill) for one in nodes):
        skills = [name for name in robot.skills if charger_of(robot, name)]
        message = f"'{interrupt.name}' drives to the dock and does not charge there"
        yield dock_without_charge.at(docks[-1].span, message, help=f"add the step '- {skills[0]}'")


def _is_dock(robot: Robot, mission: RobotMission, node: MissionNode) -> bool:
    """Return whether a step drives to the place of a charger."""
    there = goal_place(node, robot.skills[node.skill].skill.main, constants(mission), robot.manifest.places)
    docks = [one.place.value.name for _, one in robot.declared(Charges) if one.place]
    return there is not None and there.name in docks
