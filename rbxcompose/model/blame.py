"""Conditions of missions that are decided before anything runs, and what of the robot decides them."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.check import check_condition
from rbxcompose.expressions.types import FLAG
from rbxcompose.findings import Related, Span
from rbxcompose.manifest.tree import at
from rbxcompose.missions.analysis.bounds import Bounds, truth
from rbxcompose.missions.analysis.scope_types import NodeScope, base_scope, views
from rbxcompose.missions.engine.condition_watches import POSE
from rbxcompose.missions.language.asked import Asked
from rbxcompose.model.charge import batteries, constants
from rbxcompose.model.robot import Robot, RobotMission

FULL = Bounds(0.0, 1.0)  # possible levels of a battery


def decided(robot: Robot, mission: RobotMission) -> Iterator[tuple[Asked, bool]]:
    """Yield the conditions on the running robot that always hold, or never do.

    A condition that only compares written values is left out: it chooses between settings.
    """
    measured = {*robot.values, POSE}
    known = {name: Bounds(value, value) for name, value in constants(mission).items() if isinstance(value, float)}
    known |= dict.fromkeys(batteries(robot), FULL)
    for asked, scope in _conditions(robot, mission):
        is_measured = any(name.name in measured for name in asked.expression.names)
        if is_measured and not check_condition(asked.expression, scope):
            holds = truth(asked.expression.tree, known)
            if holds is not None:
                yield asked, holds


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
