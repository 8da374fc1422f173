"""A distance without a unit that is larger than all ways between places."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import Comparison, ExpressionNode, FunctionCall, Number, walk
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.scope_types import views
from rbxcompose.missions.analysis.travel_times import distance
from rbxcompose.missions.language.asked import Asked
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.model.robot import Robot
from rbxcompose.units import LENGTH, format_quantity

_MOST_PLACES = 200  # whose distances are looked at
_LEAST = 5.0  # [m] of a number that was probably not meant in metres


@check("RBX4165", Severity.WARNING, closed=("places",))
def plain_distance(robot: Robot) -> Iterator[Finding]:
    """A distance without a unit is larger than all ways between places."""
    places = list(robot.manifest.places.values())
    most = max((distance(one, other) for one, other in combinations(places[:_MOST_PLACES], 2)), default=0.0)
    for mission in robot.missions.values() if most and len(places) <= _MOST_PLACES else ():
        asked = [one for view in views(mission.program, robot.names) for one in view.node.asked]
        asked += [one.when for one in mission.program.interrupts]
        for one in asked:
            for number in _compared_with_distance(one):
                if number.value > max(most, _LEAST):
                    yield plain_distance.at(
                        inner_span(one.scalar, number.start, number.end),
                        f"this is {number.value:g} m, and no two places are farther apart than "
                        f"{format_quantity(round(most, 2), LENGTH)}",
                        help=f"write the unit: '{number.value:g} cm', or '{number.value:g} m' if that is meant",
                    )


def _compared_with_distance(asked: Asked) -> Iterator[Number]:
    """Yield the numbers without a unit that a distance is compared with."""
    for node, _ in walk(asked.expression.tree):
        sides: tuple[ExpressionNode, ...] = (node.left, node.right) if isinstance(node, Comparison) else ()
        if any(isinstance(one, FunctionCall) and one.function == "distance" for one in sides):
            for one in sides:
                if isinstance(one, Number) and one.dimension != LENGTH:
                    yield one
