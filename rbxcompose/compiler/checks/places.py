"""Rules about places and the ways between them."""

import math
from collections.abc import Iterator
from itertools import combinations
from statistics import median

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.tree import Comparison, ExpressionNode, FunctionCall, Number, walk
from rbxcompose.base.findings import Finding, Related, Severity
from rbxcompose.base.units import ANGLE, ANGULAR_SPEED, LENGTH, SPEED, TIME, Dimension, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.mission_facts import constants, ways_of
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import ScalarNode, at
from rbxcompose.missions.analysis.examined import views
from rbxcompose.missions.analysis.facts import place_in_text
from rbxcompose.missions.analysis.travel_times import distance, too_short
from rbxcompose.missions.program.parts import Asked, inner_span
from rbxcompose.sdk.capabilities import CommandsMotion, Drives, Setting

_LEAST = 3  # places
_FAR = 30.0  # [m]
_TIMES = 50.0  # as far away as the others are from each other


@check("RBX3512", Severity.WARNING, closed=("places",))
def far_place(robot: Robot) -> Iterator[Finding]:
    """A place is far from all the others."""
    for place in far_places(robot):
        away = min(distance(place, other) for name, other in robot.manifest.places.items() if name != place.name)
        yield far_place.at(
            robot.key("places", place.name),
            f"the place '{place.name}' is {format_quantity(round(away, 1), LENGTH)} away from all the others",
            help="is the unit right? Places are in metres: write 'cm' or 'mm' where that is meant",
        )


def far_places(robot: Robot) -> list[Place]:
    """Return the places that are much farther away from all others than those are from each other; mostly none."""
    places = list(robot.manifest.places.values())
    if len(places) < _LEAST:
        return []
    centre = Place("", median(place.x for place in places), median(place.y for place in places), 0.0)
    near = sorted(distance(place, centre) for place in places)[:-1]
    return [place for place in places if distance(place, centre) > max(_FAR, _TIMES * near[-1])]


@check("RBX3507", Severity.WARNING, closed=())
def full_turn(robot: Robot) -> Iterator[Finding]:
    """The heading of a place is beyond a full turn."""
    for name, place in robot.manifest.places.items():
        if abs(place.heading) > math.tau + 1e-9:
            written = at(robot.manifest.root, ("places", name, "heading"))
            is_in_degrees = isinstance(written, ScalarNode) and written.text.endswith("deg")
            within = format_quantity(math.remainder(place.heading, math.tau), ANGLE)
            yield full_turn.at(
                robot.value("places", name, "heading"),
                f"the heading of '{name}' is more than a full turn",
                label=f"this is {format_quantity(place.heading, ANGLE)}",
                help=f"write the angle within one turn: '{within}'" if is_in_degrees else "write it in 'deg'",
            )


@check("RBX3506", Severity.WARNING, closed=("places",))
def same_place(robot: Robot) -> Iterator[Finding]:
    """Two places have the same pose."""
    first: dict[tuple[float, float, float], str] = {}
    for name, place in robot.manifest.places.items():
        other = first.setdefault((place.x, place.y, place.heading), name)
        if other != name:
            yield same_place.at(
                robot.key("places", name),
                f"the places '{other}' and '{name}' are at the same spot",
                help="change or remove one of them",
                related=[Related(robot.key("places", other), "the other one")],
            )


_MOST_PLACES = 200  # whose distances are looked at
_PLAIN_DISTANCE_LEAST = 5.0  # [m] of a number that was probably not meant in metres


@check("RBX4165", Severity.WARNING, closed=("places",))
def plain_distance(robot: Robot) -> Iterator[Finding]:
    """A distance without a unit is larger than all ways between places."""
    places = list(robot.manifest.places.values()) if robot.missions else []
    most = max((distance(place, other) for place, other in combinations(places[:_MOST_PLACES], 2)), default=0.0)
    for mission in robot.missions.values() if most and len(places) <= _MOST_PLACES else ():
        asked = [one for view in views(mission.program, robot.names) for one in view.node.asked]
        asked += [interrupt.when for interrupt in mission.program.interrupts]
        for one in asked:
            for number in _compared_with_distance(one):
                if number.value > max(most, _PLAIN_DISTANCE_LEAST):
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
        if any(
            isinstance(expression_node, FunctionCall) and expression_node.function == "distance"
            for expression_node in sides
        ):
            for side in sides:
                if isinstance(side, Number) and side.dimension != LENGTH:
                    yield side


_MOST = {SPEED: (30.0, "m/s", "cm/s"), ANGULAR_SPEED: (15.0, "rad/s", "deg/s")}


@check("RBX3513", Severity.WARNING, closed=())
def plain_number(robot: Robot) -> Iterator[Finding]:
    """A speed without a unit is faster than robots are."""
    for component in robot.components.values():
        speeds: list[Drives | CommandsMotion] = [*component.declared(Drives), *component.declared(CommandsMotion)]
        for speed in speeds if component.is_sound else ():
            yield from _limits(robot, component, speed.max_speed, SPEED)
            yield from _limits(robot, component, speed.max_turn_rate, ANGULAR_SPEED)


def _limits(
    robot: Robot, component: RobotComponent, setting: Setting[float] | None, dimension: Dimension
) -> Iterator[Finding]:
    most, unit, likely = _MOST[dimension]
    node = at(robot.manifest.root, component.place(setting.field)) if setting and setting.field else None
    if not isinstance(node, ScalarNode) or node.filled is not None or not setting or setting.value < most:
        return
    if isinstance(plain_value(node), int | float):
        yield plain_number.at(
            node.span,
            f"'{setting.field}' of '{component.name}' has no unit, so it is {setting.value:g} {unit}",
            help=f"write its unit: '{setting.value:g} {likely}'",
        )


@check("RBX4120", Severity.WARNING)
def timeout_and_way(robot: Robot) -> Iterator[Finding]:
    """A timeout is shorter than the step it limits."""
    far = far_places(robot)  # told as RBX3512
    for mission in robot.missions.values():
        ways = ways_of(robot, mission)
        for one in too_short(ways, constants(mission)) if ways else ():
            if one.leg and any(place in far for place in one.leg):
                continue
            what, related = "this step", []
            if one.leg:
                here, there = one.leg
                away = format_quantity(round(distance(here, there), 2), LENGTH)
                what = f"the way from '{here.name}' to '{there.name}' ({away})"
                related = [Related(robot.key("places", place.name), f"'{place.name}'") for place in one.leg]
            yield timeout_and_way.at(
                place_in_text(one.node, one.limit),
                f"{what} takes at least {format_quantity(round(one.needs, 2), TIME)}, "
                f"but has {format_quantity(one.given, TIME)}",
                help="give it two or three times as long as it needs",
                related=related,
            )
