"""Goals of missions that a controller refuses."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.tree import Expression, ExpressionError, ExpressionNode, Minus, Variable
from rbxcompose.expressions.types import Type
from rbxcompose.findings import Finding, Related, Span
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.facts import Constants, number_in
from rbxcompose.missions.engine.value_text import show
from rbxcompose.missions.language.asked import WrittenArgument
from rbxcompose.missions.language.spans import expression_of
from rbxcompose.model.charge import constants, is_served
from rbxcompose.model.driven_joints import ROUNDED, driven_joints
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot, RobotMission
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import BoundsGoals
from rbxcompose.units import LENGTH, UNITS


@dataclass(frozen=True, slots=True)
class GoalRange:
    """What an argument may be, in SI, whose limits those are, and where they are written."""

    least: float
    greatest: float
    whose: str
    place: Span

    def nearest(self, value: float) -> float:
        """Return the nearest value within the range, or the value itself if it only differs by rounding."""
        found = max(self.least, min(self.greatest, value))
        return value if abs(found - value) <= ROUNDED * abs(found) + 1e-9 else found


@check("RBX4163", closed=(WIRING,))
def goal_beyond_limits(robot: Robot) -> Iterator[Finding]:
    """A skill is asked for what is beyond the limits."""
    bounded, told = _bounded(robot), set[Span | None]()
    for mission in robot.missions.values() if bounded else ():
        known = constants(mission)
        for node in mission.program.nodes:
            ranges = bounded.get(node.skill, {})
            skill = robot.skills[node.skill].skill if ranges else None
            for argument in node.step.arguments if skill else ():
                if skill and (allowed := ranges.get(name := argument.name or skill.main)):
                    wanted = skill.arguments[name]
                    for one in _beyond(mission, node.skill, name, argument, allowed, wanted, known):
                        if one.span not in told:  # a name that is used twice
                            yield one
                        told.add(one.span)


def _bounded(robot: Robot) -> dict[str, dict[str, GoalRange]]:
    """Return the ranges of the arguments of each skill."""
    declared = robot.declared(BoundsGoals)
    joints = {one.name: one for one in driven_joints(robot)} if declared else {}
    found: dict[str, dict[str, GoalRange]] = {}
    for component, bounds in declared:
        skill = next((name for name in robot.skills if is_served(robot, name, component, bounds.goals)), "")
        ranges = found.setdefault(skill, {})
        for argument, pair in bounds.ranges.value.items() if bounds.ranges else ():
            field = bounds.ranges.field if bounds.ranges else ""
            ranges[argument] = GoalRange(*pair, f"'{skill}'", setting_span(robot, (component, field)))
        for argument, joint in bounds.joints.value.items() if bounds.joints else ():
            if led := joints.get(joint):
                limits = led.joint.limits
                ranges[argument] = GoalRange(limits.least, limits.greatest, f"'{joint}'", led.key())
    return found


def _beyond(
    mission: RobotMission,
    skill: str,
    name: str,
    argument: WrittenArgument,
    allowed: GoalRange,
    wanted: Type,
    known: Constants,
) -> Iterator[Finding]:
    """Yield the finding about a goal whose value is known and that is refused."""
    expression, value = _expression(argument), known_value(argument, known)
    if expression is None or value is None or not isinstance(argument.value, ScalarNode):
        return
    if (nearest := allowed.nearest(value)) != value:
        declared = _declared(mission, expression)
        least, greatest = show(wanted, allowed.least), show(wanted, allowed.greatest)
        used = [Related(argument.value.span, "used here")] if declared else []
        yield goal_beyond_limits.at(
            declared or argument.value.span,
            f"'{skill}' cannot bring '{name}' to {show(wanted, value)}: {allowed.whose} is from {least} to {greatest}",
            help=_meant(argument.value.text, wanted, allowed)
            or f"the nearest that it reaches is {show(wanted, nearest)}",
            related=[*used, Related(allowed.place, "its limits")],
        )


def _meant(text: str, wanted: Type, allowed: GoalRange) -> str:
    """Return the unit that a bare length probably lacks; nothing if none would help."""
    try:
        number = float(text)
    except ValueError:
        return ""
    for unit in ("cm", "mm") if number and wanted.dimension == LENGTH else ():
        value = UNITS[unit].to_si(number)
        if allowed.nearest(value) == value:
            return f"did you mean '{text} {unit}'? A number without a unit counts in metres"
    return ""


def _expression(argument: WrittenArgument) -> Expression | None:
    try:
        return expression_of(argument.value) if isinstance(argument.value, ScalarNode) else None
    except ExpressionError:  # reported where arguments are checked
        return None


def _unsigned(tree: ExpressionNode) -> tuple[ExpressionNode, float]:
    sign = 1.0
    while isinstance(tree, Minus):
        tree, sign = tree.operand, -sign
    return tree, sign


def known_value(argument: WrittenArgument, known: Constants) -> float | None:
    """Return the number that an argument always is, if it is simple enough."""
    if (expression := _expression(argument)) is None:
        return None
    tree, sign = _unsigned(expression.tree)
    found = number_in(tree, known)
    return None if found is None else sign * found


def _declared(mission: RobotMission, expression: Expression) -> Span | None:
    """Return where the mission itself writes the value under a name."""
    tree, _ = _unsigned(expression.tree)
    if not isinstance(tree, Variable):
        return None
    given = mission.program.inputs.get(tree.name)
    datum = given.default if given else mission.program.data.get(tree.name)
    is_own = datum is not None and (given is None or mission.inputs.get(tree.name) == datum.value)
    return datum.span if datum and is_own else None
