"""Rules about values, places and the ways between them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations
from statistics import median

from rbxcompose.base.config import Dimensioned, Place
from rbxcompose.base.expressions.tree import Comparison, ExpressionNode, FunctionCall, Number, walk
from rbxcompose.base.expressions.types import TYPES, TypeKind
from rbxcompose.base.findings import (
    DID_YOU_MEAN,
    MISSIONS,
    NAMES,
    WIRING,
    Finding,
    Related,
    Severity,
    correction,
    suggest,
)
from rbxcompose.base.units import ANGLE, ANGULAR_SPEED, LENGTH, RATIO, SPEED, TIME, UNITS, Dimension, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.flow import Wrong, is_written
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent, resolve
from rbxcompose.compiler.model.skills import constants, ways_of
from rbxcompose.compiler.model.values import condition_of, fitting_kinds
from rbxcompose.compiler.sections.missions import triggers
from rbxcompose.compiler.sections.values import ValueModel
from rbxcompose.manifest.tree import ScalarNode, at, plain_value
from rbxcompose.missions.analysis.examined import views
from rbxcompose.missions.analysis.facts import Constants, called, number_of, place_in_text, published
from rbxcompose.missions.analysis.travel_times import distance, too_short
from rbxcompose.missions.program.parts import Asked, MessageTemplate, TemplateShape, WrittenValue, inner_span
from rbxcompose.missions.sources import ValueSource
from rbxcompose.msgs.fields import NoFieldError, field_type
from rbxcompose.sdk.capabilities import CommandsMotion, Drains, Drives, Setting, Warns
from rbxcompose.sdk.ports import In, Out, Serves

_PERCENT = "%"


@check("RBX4188", Severity.WARNING, closed=(WIRING,))
def fraction_of_percent(robot: Robot) -> Iterator[Finding]:
    """A mission sends a fraction to what counts in percent."""
    takers = {(type(end.port) is Serves, end.topic): end for end in robot.ends if _unit(end) == _PERCENT}
    for mission in robot.missions.values() if takers else ():
        known = constants(mission)
        for node in mission.program.nodes:
            sent = [*((True, one) for one in called(node)), *((False, template) for template in published(node))]
            for is_call, message in sent:
                if taker := takers.get((is_call, resolve(message.target.text, robot.manifest.bus.namespace or ""))):
                    yield from _limits(robot, taker, message, known)


def _unit(end: PortEnd) -> str:
    return end.port.unit if isinstance(end.port, In | Serves) else ""


def _limits(robot: Robot, taker: PortEnd, message: MessageTemplate, known: Constants) -> Iterator[Finding]:
    for value in _values(message.body):
        number = number_of(value.expression, known)
        if number is not None and 0.0 < number <= 1.0:
            yield fraction_of_percent.at(
                value.scalar.span,
                f"'{taker.instance}' takes percent, from 0 to 100: {number:g} is almost nothing",
                help=f"write {100 * number:g}",
                related=[Related(robot.component_span(taker.instance), "takes percent")],
            )


def _values(shape: TemplateShape | None) -> Iterator[WrittenValue]:
    match shape:
        case WrittenValue():
            yield shape
        case Mapping():
            for inner in shape.values():
                yield from _values(inner)


@check("RBX3511", Severity.WARNING, closed=(WIRING,))
def limit_in_percent(robot: Robot) -> Iterator[Finding]:
    """A limit is a fraction, but the number is in percent."""
    for component, warns in robot.declared(Warns):
        limits = [setting for setting in (warns.warn, warns.error) if setting is not None and 0 < setting.value < 1]
        for limit in limits if limits and component.is_sound else ():
            if writers := _in_percent(robot, component):
                yield _limit_in_percent(robot, component, limit, writers)


def _in_percent(robot: Robot, component: RobotComponent) -> list[str]:
    """Return who writes what a component compares, if all of that is in percent."""
    topics = {end.topic for end in component.ends if isinstance(end.port, In)}
    ends = [end for topic in topics for end in robot.writers.get(topic, ())]
    units = {end.port.unit for end in ends if isinstance(end.port, Out)}
    return [end.instance for end in ends] if units == {_PERCENT} else []


def _limit_in_percent(robot: Robot, component: RobotComponent, limit: Setting[float], writers: list[str]) -> Finding:
    return limit_in_percent.at(
        robot.value(*component.place(limit.field)),
        f"'{limit.field}' of '{component.name}' is {limit.value:g}, but '{writers[0]}' reports percent, from 0 to 100",
        help=f"write '{limit.field}: {100 * limit.value:g}'",
        related=[Related(robot.component_span(writer), "reports percent") for writer in writers],
    )


_LEAST = 0.01


@check("RBX3515", Severity.WARNING, closed=())
def tiny_share(robot: Robot) -> Iterator[Finding]:
    """A limit is less than one percent."""
    for component in robot.components.values():
        levels: list[Warns | Drains] = [*component.declared(Warns), *component.declared(Drains)]
        for limit in (each for level in levels for each in (level.warn, level.error) if component.is_sound):
            is_tiny = limit is not None and 0.0 < limit.value < _LEAST and _is_share(component, limit.field)
            if limit and is_tiny and is_written(robot, component, limit.field):
                yield tiny_share.at(
                    robot.value(*component.place(limit.field)),
                    f"'{limit.field}' of '{component.name}' is {100.0 * limit.value:.3g} %, almost nothing",
                    help=f"write '{1e4 * limit.value:.3g} %', if that is meant",
                )


def _is_share(component: RobotComponent, field: str) -> bool:
    known = type(component.config).model_fields.get(field)
    return known is not None and any(isinstance(one, Dimensioned) and one.dimension == RATIO for one in known.metadata)


_OF_TOPIC = ("field", "type")  # keys that are for data from a topic
_WORDS = {TypeKind.TEXT: "write 'type: text'", TypeKind.FLAG: "write 'type: flag'"}


@check("RBX4161", is_fixable=True)
def value_of_message(robot: Robot) -> Iterator[Finding]:
    """A value does not fit its message."""
    for name, entry in robot.manifest.values.items():
        source = robot.values.get(name)
        if entry.port is not None:
            yield from _without_effect(robot, name, entry)
        elif source is not None:
            yield from _value_of_message_unit(robot, name, entry)
            yield from _field(robot, name, entry, source)


def _without_effect(robot: Robot, name: str, entry: ValueModel) -> Iterator[Finding]:
    for key in _OF_TOPIC:
        if getattr(entry, key) is not None:
            message = f"'{key}' has no effect on the value '{name}': its port has a message of its own"
            yield value_of_message.at(robot.key("values", name, key), message, help=f"remove '{key}'")


def _value_of_message_unit(robot: Robot, name: str, entry: ValueModel) -> Iterator[Finding]:
    declared = TYPES.get(entry.type or "")
    unit = UNITS.get(entry.unit or "")
    if declared and unit and declared.dimension != unit.dimension:
        message = f"the value '{name}' is {declared.phrase}, and '{unit.name}' is a unit of {unit.dimension.phrase}"
        help_text = f"write 'type: {unit.dimension.name}', or another unit"
        yield value_of_message.at(robot.value("values", name, "unit"), message, help=help_text)


def _field(robot: Robot, name: str, entry: ValueModel, source: ValueSource) -> Iterator[Finding]:
    try:
        ros = field_type(source.message, source.field)
    except NoFieldError as error:
        span = robot.value("values", name, "field" if entry.field else "topic")
        message = f"the value '{name}' comes from a field that {error.message} does not have: '{error.name}'"
        yield value_of_message.misspelt(span, message, error.name, error.fields, "its fields", within=entry.field or "")
        return
    fitting, declared = fitting_kinds(ros), TYPES.get(entry.type or "")
    if fitting and declared and declared.kind not in fitting:
        message = f"the value '{name}' is {declared.phrase}, but '{source.field}' of {source.message} is a {ros}"
        help_text = _WORDS.get(fitting[0], "write 'type: number', or what it measures")
        yield value_of_message.at(robot.value("values", name, "type"), message, help=help_text)


@check("RBX3005", is_fixable=True, closed=(NAMES,))
def value_source(robot: Robot) -> Iterator[Finding]:
    """A value names no output of a component."""
    for name, entry in robot.manifest.values.items():
        if entry.port is not None and (wrong := _missing(robot, name, entry.port)):
            span = robot.value("values", name, "port")
            fix = correction(wrong.name, wrong.valid, span, within=entry.port)
            message = f"value '{name}' {wrong.message}"
            yield value_source.at(span, message, help=wrong.help, fix=fix, about=[name, wrong.name])


def _missing(robot: Robot, name: str, source: str) -> Wrong | None:
    component, dot, port = source.partition(".")
    part = robot.components.get(component)
    if part is None:
        if component in robot.written:
            return None  # it exists, but has mistakes, which are reported at their own place
        message = f"comes from a component that the robot does not have: '{component}'"
        outputs = [f"{end.instance}.{end.name}" for end in robot.ends if end.name == component and not port]
        if outputs:
            return Wrong(message, f"{DID_YOU_MEAN} '{outputs[0]}'? It is an output, and needs its component")
        having = [end.instance for end in robot.ends if port and end.name == port and isinstance(end.port, Out)]
        if len(having) == 1:  # the only one with such an output
            return Wrong(message, f"{DID_YOU_MEAN} '{having[0]}.{port}'?", component, having)
        return Wrong(
            message, suggest(component, robot.components, "components of this robot"), component, robot.components
        )
    outputs = [end.name for end in part.ends if isinstance(end.port, Out)]
    taken = part.end(port)
    if taken is not None and isinstance(taken.port, In):
        writers = [f"{end.instance}.{end.name}" for end in robot.writers.get(taken.topic, ())]
        words = f"{DID_YOU_MEAN} '{writers[0]}'?" if writers else suggest(port, outputs, "its outputs")
        return Wrong(f"comes from '{source}', which takes messages, and sends none", words)
    if name in robot.values:
        return None  # the level of a diagnostics group is a value, too
    if not dot:
        message = f"names a component; it must name one of its outputs, as '{component}.PORT'"
        return Wrong(message, suggest("", outputs, "ports"))
    if port not in outputs:
        message = f"comes from an output that '{component}' does not have: '{port}'"
        return Wrong(message, suggest(port, outputs, "its outputs"), port, outputs)
    if name not in robot.values:
        message = "is a whole message; a mission can read only single values"
        return Wrong(message, "write a map with 'topic', 'field', 'type'")
    return None


@check("RBX3012", Severity.WARNING, closed=(MISSIONS, triggers.name))
def unread_value(robot: Robot) -> Iterator[Finding]:
    """A value that no mission reads."""
    conditions = (condition_of(robot, name)[0] for name in triggers.names_in(robot.manifest.root))
    read = frozenset(name.name for one in conditions if one for name in one.names)
    read = read.union(*(mission.program.reads for mission in robot.missions.values()))
    given = frozenset[str]().union(*(part.values for part in robot.manifest.parts.values()))
    for name in robot.manifest.values if robot.missions else ():
        if name not in read | given:
            yield unread_value.at(
                robot.key("values", name),
                f"no mission reads the value '{name}'",
                help=f"remove it, or read it in a mission as '${name}'",
            )


@check("RBX3510", Severity.WARNING, closed=())
def no_limit(robot: Robot) -> Iterator[Finding]:
    """A component compares a number with no limit."""
    for component in robot.components.values():
        limits = component.declared(Warns)
        if limits and component.is_sound and all(limit.warn is None and limit.error is None for limit in limits):
            keys = [name for name in type(component.config).model_fields if name.startswith(("warn", "error"))]
            yield no_limit.at(
                robot.component_span(component.name),
                f"'{component.name}' compares its number with no limit",
                help=f"give it one: {', '.join(keys)}",
            )


_FEWEST = 3  # places
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
    if len(places) < _FEWEST:
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
        if any(isinstance(side, FunctionCall) and side.function == "distance" for side in sides):
            for side in sides:
                if isinstance(side, Number) and side.dimension != LENGTH:
                    yield side


_GREATEST = {
    SPEED: (30.0, "m/s", ("cm/s",)),
    ANGULAR_SPEED: (15.0, "rad/s", ("deg/s",)),
    LENGTH: (3.0, "m", ("mm", "cm")),
}


@check("RBX3513", Severity.WARNING, closed=())
def plain_number(robot: Robot) -> Iterator[Finding]:
    """A number without a unit is larger than robots have it."""
    for component in robot.components.values():
        speeds: list[Drives | CommandsMotion] = [*component.declared(Drives), *component.declared(CommandsMotion)]
        for speed in speeds if component.is_sound else ():
            yield from _too_large(robot, component, speed.max_speed, SPEED)
            yield from _too_large(robot, component, speed.max_turn_rate, ANGULAR_SPEED)
        for base in component.declared(Drives) if component.is_sound else ():
            yield from _too_large(robot, component, base.wheel_distance, LENGTH)


def _too_large(
    robot: Robot, component: RobotComponent, setting: Setting[float] | None, dimension: Dimension
) -> Iterator[Finding]:
    most, unit, likely = _GREATEST[dimension]
    node = at(robot.manifest.root, component.place(setting.field)) if setting and setting.field else None
    if not isinstance(node, ScalarNode) or node.filled is not None or not setting or setting.value < most:
        return
    if isinstance(plain_value(node), int | float):
        yield plain_number.at(
            node.span,
            f"'{setting.field}' of '{component.name}' has no unit, so it is {setting.value:g} {unit}",
            help="write its unit: " + " or ".join(f"'{setting.value:g} {word}'" for word in likely),
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
