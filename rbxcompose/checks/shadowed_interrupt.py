"""Interrupts that others keep from cutting in."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import Expression, ExpressionNode, FunctionCall, Junction, Not, walk
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.bounds import Bounds, Known, truth
from rbxcompose.missions.program.program import END, Interrupt, Program
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot, RobotMission

_ITS_OWN = ("new", "age")  # their answers depend on when the interrupt acted last


@check("RBX4184", Severity.WARNING, closed=())
def shadowed_interrupt(robot: Robot) -> Iterator[Finding]:
    """An interrupt cannot cut in, because an earlier one always does first."""
    for mission in robot.missions.values():
        known = bounds_of(mission)
        for index, later in enumerate(mission.program.interrupts):
            for earlier in mission.program.interrupts[:index]:
                if _keeps_out(robot, mission.program, earlier, later, known):
                    acts = "never acts" if earlier.afterwards == END else "waits until its reaction is done"
                    yield shadowed_interrupt.at(
                        later.when.scalar.span,
                        f"'{earlier.name}' comes first and holds whenever this does, so '{later.name}' {acts}",
                        help=f"put '{later.name}' before '{earlier.name}': the first one that holds wins",
                        related=[Related(earlier.when.scalar.span, "it holds as well")],
                    )
                    break


def bounds_of(mission: RobotMission) -> Known:
    """Return the bounds of the numbers of a mission that nothing changes."""
    numbers = {name: value for name, value in constants(mission).items() if isinstance(value, float)}
    return {name: Bounds(value, value) for name, value in numbers.items()}


def _keeps_out(robot: Robot, program: Program, earlier: Interrupt, later: Interrupt, known: Known) -> bool:
    one, other = earlier.when.expression, later.when.expression
    if one.text == other.text or _is_its_own(robot, one) or _is_its_own(robot, other):
        return False  # RBX4171 tells two equal ones
    if truth(one.tree, known) is not None or truth(other.tree, known) is not None:
        return False  # decided by itself, which others tell
    takes_time = earlier.root is not None and any(below.step.waits for below in program.below(earlier.root))
    return (takes_time or earlier.afterwards == END) and implies(other, one, known)


def _is_its_own(robot: Robot, expression: Expression) -> bool:
    calls = (part for part, _ in walk(expression.tree) if isinstance(part, FunctionCall))
    names = {name.name for name in expression.names}
    return any(call.function in _ITS_OWN for call in calls) or bool(names & robot.names.events)


def implies(narrow: Expression, wide: Expression, known: Known) -> bool:
    """Return whether one condition surely holds whenever another one does."""
    all_of, any_of = _parts(narrow.tree, "and"), _parts(wide.tree, "or")
    if {narrow.text[one.start : one.end] for one in all_of} & {wide.text[one.start : one.end] for one in any_of}:
        return True
    start, end = narrow.tree.start, narrow.tree.end
    return truth(Junction(start, end, "and", (*all_of, Not(start, end, wide.tree))), known) is False


def _parts(tree: ExpressionNode, operator: str) -> tuple[ExpressionNode, ...]:
    return tree.operands if isinstance(tree, Junction) and tree.operator == operator else (tree,)
