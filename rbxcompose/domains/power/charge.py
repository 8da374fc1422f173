"""The interrupts of missions that charge the battery."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Comparison, Variable
from rbxcompose.compiler.model.mission_facts import batteries, constants, is_served
from rbxcompose.compiler.model.robot import Robot, RobotComponent, RobotMission
from rbxcompose.missions.analysis.facts import number_in
from rbxcompose.missions.program.program import Interrupt, MissionNode
from rbxcompose.sdk.capabilities import Charges, Drains


@dataclass(frozen=True, slots=True)
class ChargeInterrupt:
    """An interrupt that charges the battery when its level is below `level` (a ratio)."""

    interrupt: Interrupt
    reaction: tuple[MissionNode, ...]
    battery: RobotComponent
    drains: Drains
    charges: Charges
    level: float


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
    found = (pair for pair in robot.declared(Charges) if is_served(robot, skill, pair[0], pair[1].goals))
    return next(found, None)
