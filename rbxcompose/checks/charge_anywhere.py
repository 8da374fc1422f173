"""A reaction that charges wherever the robot happens to be."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import Comparison, Variable
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.travel_times import Ways, distance, too_short
from rbxcompose.missions.program.answers import NodeFlow
from rbxcompose.missions.program.program import MissionNode, Program
from rbxcompose.model.charge import batteries, charger_of, constants, navigator_of, ways_of
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import MISSIONS, WIRING
from rbxcompose.sdk.capabilities import Charges


@check("RBX4185", Severity.WARNING, closed=(WIRING, MISSIONS, "places"))
def charge_anywhere(robot: Robot) -> Iterator[Finding]:
    """A reaction to a low battery charges wherever the robot is."""
    levels = batteries(robot)
    for mission in robot.missions.values():
        program, ways = mission.program, ways_of(robot, mission)
        if ways is None or not ways.driving.skill:
            continue
        list(too_short(ways, constants(mission)))  # consumed for its side effect: it walks the whole mission
        for interrupt in program.interrupts:
            tree = interrupt.when.expression.tree
            is_low = isinstance(tree, Comparison) and isinstance(tree.left, Variable) and tree.left.name in levels
            below = program.below(interrupt.root) if interrupt.root is not None and is_low else ()
            if any(_may_move(robot, node) for node in below):
                continue
            for node in below:
                charger, charges = charger_of(robot, node.skill) or (None, None)
                if charger is None or charges is None or charges.place is None or not _counts(program, node):
                    continue
                away = _elsewhere(ways, charges)
                if away:
                    dock = charges.place.value.name
                    yield charge_anywhere.at(
                        node.span,
                        f"'{interrupt.name}' charges wherever it cuts in, such as at '{away}': "
                        f"'{node.skill}' works only at '{dock}'",
                        help=f"drive to the dock first: '- {ways.driving.skill}: {dock}'",
                        related=[Related(setting_span(robot, (charger, charges.place.field)), "the dock")],
                    )


def _may_move(robot: Robot, node: MissionNode) -> bool:
    """Return whether a step may bring the robot to another place, as everything may that is not ours to know."""
    effects = node.step.effects
    if node.skill:
        return charger_of(robot, node.skill) is None or navigator_of(robot, node.skill) is not None
    return bool(node.step.uses or effects.published or effects.called)


def _counts(program: Program, node: MissionNode) -> bool:
    """Return whether a step is always done in its turn, and its failure is that of the reaction."""
    one: MissionNode | None = node
    while one is not None:
        above = None if one.parent is None else program.nodes[one.parent]
        if one.may_be_left_out or one.is_forgiven or (above and above.step.flow is not NodeFlow.IN_TURN):
            return False
        one = above
    return True


def _elsewhere(ways: Ways, charges: Charges) -> str:
    """Return a place that the mission drives to and that is out of reach of the charger."""
    if charges.place is None:
        return ""
    dock, reach = charges.place.value, charges.reach.value if charges.reach else 0.0
    far = (name for name, one in ways.visited.items() if distance(one, dock) > reach + ways.driving.tolerance)
    return next(far, "")
