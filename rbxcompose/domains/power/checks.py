"""Rules about batteries and charging."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from rbxcompose.base.config import Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Comparison, Junction, Variable
from rbxcompose.base.findings import MISSIONS, OWN, WIRING, Finding, Related, Severity
from rbxcompose.base.units import LENGTH, RATIO, TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.checks.missions import bounds_of, implies
from rbxcompose.compiler.checks.values import far_places
from rbxcompose.compiler.model.flow import OTHER_TYPE, is_written, setting_span
from rbxcompose.compiler.model.robot import Robot, RobotComponent, RobotMission
from rbxcompose.compiler.model.skills import batteries, blamed, constants, is_served, navigator_of, ways_of
from rbxcompose.missions.analysis.facts import Constants, goal_place, number_in, truth
from rbxcompose.missions.analysis.travel_times import Ways, distance, too_short
from rbxcompose.missions.program.parts import Asked, NodeFlow
from rbxcompose.missions.program.program import Interrupt, MissionNode, Program
from rbxcompose.sdk.capabilities import Charges, Drains, Navigates, Setting, Warns


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


_ABSURD = 1.0  # [m] of a tolerance, which is then what is wrong
_LASTS = "how long a full battery lasts"


@check("RBX4121")
def charge_and_call(robot: Robot) -> Iterator[Finding]:
    """A charge ends below the level that triggers it."""
    for mission in robot.missions.values():
        for call in calls(robot, mission):
            until = call.charges.until
            if until and until.value < call.level <= 1.0:
                span, related = blamed(robot, mission, call.interrupt.when)
                yield charge_and_call.at(
                    span,
                    f"the interrupt '{call.interrupt.name}' charges below {format_quantity(call.level, RATIO)}, "
                    f"but a charge may end at {format_quantity(until.value, RATIO)}",
                    help="charge at a lower level",
                    related=related,
                )


@check("RBX4185", Severity.WARNING, closed=(WIRING, MISSIONS, "places"))
def charge_anywhere(robot: Robot) -> Iterator[Finding]:
    """A reaction to a low battery charges wherever the robot is."""
    levels = batteries(robot)
    for mission, ways in _walked(robot):
        program = mission.program
        if not ways.driving.skill:
            continue
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


def _walked(robot: Robot) -> Iterator[tuple[RobotMission, Ways]]:
    """Yield the missions that drive, with their ways, which were walked to the end."""
    for mission in robot.missions.values():
        if (ways := ways_of(robot, mission)) is not None:
            list(too_short(ways, constants(mission)))  # consumed for its side effect: it walks the whole mission
            yield mission, ways


def _may_move(robot: Robot, node: MissionNode) -> bool:
    """Return whether a step may bring the robot to another place, as everything may that is not ours to know."""
    effects = node.step.effects
    if node.skill:
        return charger_of(robot, node.skill) is None or navigator_of(robot, node.skill) is not None
    return bool(node.step.uses or effects.published or effects.called)


def _counts(program: Program, node: MissionNode) -> bool:
    """Return whether a step is always done in its turn, and its failure is that of the reaction."""
    return not any(
        inner.may_be_left_out or inner.is_forgiven or (above and above.step.flow is not NodeFlow.IN_TURN)
        for inner, above in _upwards(program, node)
    )


def _upwards(program: Program, node: MissionNode) -> Iterator[tuple[MissionNode, MissionNode | None]]:
    """Yield a node and all that it is in, each with the one above it."""
    inner: MissionNode | None = node
    while inner is not None:
        above = None if inner.parent is None else program.nodes[inner.parent]
        yield inner, above
        inner = above


def _elsewhere(ways: Ways, charges: Charges) -> str:
    """Return a place that the mission drives to and that is out of reach of the charger."""
    return next((name for name, place in ways.visited.items() if _is_away(ways, place, charges)), "")


def _is_away(ways: Ways, here: Place, charges: Charges) -> bool:
    """Return whether the robot may be out of reach of a charger when it is at a place."""
    reach = charges.reach.value if charges.reach else 0.0
    return charges.place is not None and distance(here, charges.place.value) > reach + ways.driving.tolerance


@check("RBX4130", closed=(WIRING, "places"))
def charge_elsewhere(robot: Robot) -> Iterator[Finding]:
    """A mission charges where there is no dock."""
    for mission, ways in _walked(robot):
        for number, here in ways.starts_at.items():
            node = mission.program.nodes[number]
            charger, charges = charger_of(robot, node.skill) or (None, None)
            may_fail = node.may_be_left_out or not _counts_failures(mission.program, node)
            if charger is None or charges is None or charges.place is None or may_fail:
                continue
            dock = charges.place.value
            if _is_away(ways, here, charges):
                yield charge_elsewhere.at(
                    node.span,
                    f"'{node.skill}' works only at '{dock.name}', but here the robot is at '{here.name}'",
                    help=f"drive to the dock first: '{ways.driving.skill}: {dock.name}'",
                    related=[Related(setting_span(robot, (charger, charges.place.field)), "the dock of the charger")],
                )


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


@check("RBX4190", Severity.WARNING, closed=(OWN,))
def given_up_before(robot: Robot) -> Iterator[Finding]:
    """A step gives up at a level above that at which the battery is charged."""
    for mission in robot.missions.values():
        for call in calls(robot, mission):
            for node in mission.program.below(mission.program.main):
                watched = [asked for asked in node.asked[node.own :] if asked.is_watched]  # those of 'as_long_as'
                for asked in watched if _counts_failures(mission.program, node) else ():
                    least = _least_level(asked, call, constants(mission))
                    if least is not None and call.level < least <= 1.0:
                        level, limit = format_quantity(call.level, RATIO), format_quantity(least, RATIO)
                        yield given_up_before.at(
                            asked.scalar.span,
                            f"this fails at {limit}, before '{call.interrupt.name}' charges the battery below {level}",
                            help=f"charge it at {limit} or above, or let this go on until below {level}",
                            related=[Related(call.interrupt.when.scalar.span, "it charges at this")],
                        )


def _least_level(asked: Asked, call: ChargeInterrupt, known: Constants) -> float | None:
    """Return the level of the battery that a condition needs at least, None if it needs none."""
    when, tree = call.interrupt.when.expression.tree, asked.expression.tree
    level = when.left if isinstance(when, Comparison) else None
    parts = tree.operands if isinstance(tree, Junction) and tree.operator == "and" else (tree,)
    for part in parts:
        match part:
            case Comparison(operator=">" | ">=", left=Variable(name=name), right=limit):
                if isinstance(level, Variable) and name == level.name:
                    return number_in(limit, known)
    return None


def _counts_failures(program: Program, node: MissionNode) -> bool:
    """Return whether nothing else follows a failure of a step, which may then not be meant."""
    return not any(
        inner.is_forgiven or (above and above.step.flow in (NodeFlow.FIRST, NodeFlow.OPEN))
        for inner, above in _upwards(program, node)
    )


@check("RBX3505", Severity.WARNING, closed=())
def charger_reach(robot: Robot) -> Iterator[Finding]:
    """The robot may stop too far from its dock to be charged."""
    drivers = [(item, navigates.tolerance) for item, navigates in robot.declared(Navigates) if navigates.tolerance]
    if not drivers:
        return
    driver, tolerance = min(drivers, key=lambda one: one[1].value)
    for component, charges in robot.declared(Charges):
        reach = charges.reach
        if reach and charges.place and reach.value < tolerance.value:
            here, there = (component, reach.field), (driver, tolerance.field)
            changes = [f"'{name}' {how}" for name, how in ((here[1], "larger"), (there[1], "smaller")) if name]
            both = (there, here) if tolerance.value > _ABSURD else (here, there)
            yield charger_reach.at(
                setting_span(robot, *both),
                f"'{component.name}' charges within {format_quantity(reach.value, LENGTH)} of the dock, "
                f"but '{driver.name}' may end {format_quantity(tolerance.value, LENGTH)} away from it",
                help=f"make {', or '.join(changes)}" if changes else OTHER_TYPE,
                related=[Related(setting_span(robot, there), f"its '{there[1]}'" if there[1] else "drives there")],
            )


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
    steps = [nodes[child] for child in root.children] if root and root.step.flow is NodeFlow.IN_TURN else []
    if root is None or any(step.children or not step.skill for step in steps):
        return  # more than drives and charges, one after the other
    drives = [step for step in steps if navigator_of(robot, step.skill)]
    docks = [drive for drive in drives if _is_dock(robot, mission, drive)]
    charges = [step for step in steps if charger_of(robot, step.skill)]
    if docks and charges and charges[0].number < drives[0].number:
        message = f"'{interrupt.name}' charges before it drives to the dock"
        related = [Related(docks[0].span, "it drives there only now")]
        yield dock_without_charge.at(charges[0].span, message, help="exchange these steps", related=related)
    elif docks and docks[-1] is steps[-1] and not any(charger_of(robot, node.skill) for node in nodes):
        skills = [name for name in robot.skills if charger_of(robot, name)]
        message = f"'{interrupt.name}' drives to the dock and does not charge there"
        yield dock_without_charge.at(docks[-1].span, message, help=f"add the step '- {skills[0]}'")


def _is_dock(robot: Robot, mission: RobotMission, node: MissionNode) -> bool:
    """Return whether a step drives to the place of a charger."""
    there = goal_place(node, robot.skills[node.skill].skill.main, constants(mission), robot.manifest.places)
    docks = [charges.place.value.name for _, charges in robot.declared(Charges) if charges.place]
    return there is not None and there.name in docks


@check("RBX4124", Severity.WARNING)
def empty_on_the_way(robot: Robot) -> Iterator[Finding]:
    """The battery may be empty before the robot reaches its dock."""
    for mission, ways in _walked(robot):
        known = constants(mission)
        lost = {place.name for place in far_places(robot)}  # reported as RBX3512
        for call in calls(robot, mission):
            goals = (
                goal_place(node, ways.driving.main, known, ways.places)
                for node in call.reaction
                if node.skill == ways.driving.skill
            )
            dock = next((place for place in goals if place), None)
            runtime = call.drains.runtime
            visited = [place for name, place in ways.visited.items() if name not in lost]
            if dock is None or runtime is None or not visited or dock.name in lost:
                continue
            far = max(visited, key=lambda place: ways.between(place, dock))
            lasts, needs = call.level * runtime.value, ways.between(far, dock)
            if runtime.value < needs:
                yield _never_there(robot, call.battery, runtime, f"from '{far.name}' to '{dock.name}'", needs)
            elif 0 <= lasts < needs:
                span, related = blamed(robot, mission, call.interrupt.when)
                yield empty_on_the_way.at(
                    span,
                    f"{format_quantity(call.level, RATIO)} last for {format_quantity(round(lasts, 1), TIME)}, but the "
                    f"way from '{far.name}' to '{dock.name}' takes {format_quantity(round(needs, 1), TIME)}",
                    help="interrupt earlier",
                    related=[*related, Related(setting_span(robot, (call.battery, runtime.field)), _LASTS)],
                )


def _never_there(robot: Robot, battery: RobotComponent, runtime: Setting[float], way: str, needs: float) -> Finding:
    """Return the finding about a battery that even when full is empty before the dock is reached."""
    lasts, takes = format_quantity(runtime.value, TIME), format_quantity(round(needs, 1), TIME)
    return empty_on_the_way.at(
        setting_span(robot, (battery, runtime.field)),
        f"a full battery lasts for {lasts}, but the way {way} takes {takes}",
        help=f"make it last longer: several times {takes}",
    )


@check("RBX4160", Severity.WARNING)
def late_call(robot: Robot) -> Iterator[Finding]:
    """The battery is in error before the mission charges it."""
    for mission in robot.missions.values():
        for call in calls(robot, mission):
            error = call.drains.error
            if error and call.level < error.value and is_written(robot, call.battery, error.field):
                span, related = blamed(robot, mission, call.interrupt.when)
                level, limit = format_quantity(call.level, RATIO), format_quantity(error.value, RATIO)
                yield late_call.at(
                    span,
                    f"'{mission.name}' charges '{call.battery.name}' below {level}; it is in error below {limit}",
                    help=f"charge it at {limit} or above, or put its '{error.field or 'error'}' below {level}",
                    related=[*related, Related(setting_span(robot, (call.battery, error.field)), "its status")],
                )


@check("RBX3502")
def threshold_order(robot: Robot) -> Iterator[Finding]:
    """An error is reported before a warning."""
    for component, drains in robot.declared(Drains):
        yield from _disorder(robot, component, drains.warn, drains.error, "below", lambda x: format_quantity(x, RATIO))
    for component, warns in robot.declared(Warns):
        side = "above" if warns.is_above else "below"
        yield from _disorder(robot, component, warns.warn, warns.error, side, lambda x: f"{x:g}")


def _disorder(
    robot: Robot,
    component: RobotComponent,
    warn: Setting[float] | None,
    error: Setting[float] | None,
    side: str,
    text: Callable[[float], str],
) -> Iterator[Finding]:
    if not (warn and error) or (warn.value <= error.value if side == "above" else warn.value >= error.value):
        return
    here, there = (component, warn.field), (component, error.field)
    other = "below" if side == "above" else "above"
    yield threshold_order.at(
        setting_span(robot, here, there),
        f"'{component.name}' can never warn: it is already in error {side} {text(error.value)}, "
        f"and warns {side} {text(warn.value)}",
        help=f"'{warn.field or 'warn'}' must be {other} '{error.field or 'error'}'",
        related=[Related(setting_span(robot, there, here), f"in error {side} this")],
    )
