"""A loop that ends at a level of the battery which an interrupt never lets it reach."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.shadowed_interrupt import bounds_of, implies
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.bounds import truth
from rbxcompose.missions.language.asked import Asked
from rbxcompose.missions.program.program import Program
from rbxcompose.model.charge import ChargeInterrupt, calls
from rbxcompose.model.robot import Robot
from rbxcompose.rules import OWN


@check("RBX4189", Severity.WARNING, closed=(OWN,))
def charged_before(robot: Robot) -> Iterator[Finding]:
    """A loop ends at a level before which the battery is charged."""
    for mission in robot.missions.values():
        known = bounds_of(mission)
        for call in calls(robot, mission):
            for asked in _ends_of_loops(mission.program, call):
                tree = asked.expression.tree
                if truth(tree, known) is None and implies(asked.expression, call.interrupt.when.expression, known):
                    yield charged_before.at(
                        asked.scalar.span,
                        f"'{call.interrupt.name}' charges the battery before this holds: it never ends the loop",
                        help="end it at a higher level, or by something else",
                        related=[Related(call.interrupt.when.scalar.span, "it charges at this")],
                    )


def _ends_of_loops(program: Program, call: ChargeInterrupt) -> Iterator[Asked]:
    for node in program.nodes:
        if node.children and node not in call.reaction:
            yield from (asked for asked in node.asked[: node.own] if asked.is_watched)
