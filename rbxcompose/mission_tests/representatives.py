"""Values that represent all others: one on each side of every number that a mission compares a value with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from rbxcompose.expressions.tree import Comparison, Expression, ExpressionNode, Flag, Minus, Text, Variable, Word, walk
from rbxcompose.expressions.types import TypeKind
from rbxcompose.expressions.values import Value
from rbxcompose.mission_tests.mission_facts import missions_in
from rbxcompose.missions.analysis.facts import constants_of, number_in
from rbxcompose.missions.engine.condition_watches import POSE
from rbxcompose.missions.program.program import Program, RobotNames

MOST_PLACES = 3  # where the robot may be
BESIDE = 0.1  # distance of the outermost values from a limit, as a fraction of it
OTHER = "something else"  # a text that no comparison contains


def representatives(linked: Program, robot: RobotNames, inputs: Mapping[str, Value]) -> dict[str, tuple[Value, ...]]:
    """Return values for each robot value that a mission reads; the largest number, or true, comes first."""
    compared: dict[str, set[Value]] = {}
    for program in missions_in(linked):
        constants = constants_of(program, inputs if program is linked else {})
        for _, asked in program.asked():
            for name, value in _compared(asked.expression, constants):
                compared.setdefault(name, set()).add(value)
    read = frozenset[str]().union(*(one.reads for one in missions_in(linked)))
    found = {name: _values(robot, name, compared.get(name, set())) for name in sorted(read & robot.values.keys())}
    if POSE in read and robot.places:
        found[POSE] = tuple(robot.places.values())[:MOST_PLACES]
    return found


def _values(robot: RobotNames, name: str, compared: set[Value]) -> tuple[Value, ...]:
    kind = robot.values[name]
    numbers = sorted(float(one) for one in compared if isinstance(one, int | float) and not isinstance(one, bool))
    if kind.kind is TypeKind.FLAG:
        return (True, False)
    if kind.choices:
        return kind.choices
    words = tuple(sorted(one for one in compared if isinstance(one, str)))
    if words or kind.kind is TypeKind.TEXT:
        return (*words, OTHER)
    return _around(numbers) if numbers else (0.0,)


def _around(limits: Sequence[float]) -> tuple[float, ...]:
    """Return numbers above, between and below the limits, largest first."""
    width = max(abs(limit) for limit in limits) * BESIDE or BESIDE
    between = [(one + other) / 2 for one, other in pairwise(limits)]
    return tuple(sorted({limits[-1] + width, *between, limits[0] - width}, reverse=True))


def _compared(expression: Expression, constants: Mapping[str, Value]) -> Iterator[tuple[str, Value]]:
    """Yield each name that is compared with a constant, and the constant."""
    for part, _ in walk(expression.tree):
        if isinstance(part, Comparison):
            for one, other in ((part.left, part.right), (part.right, part.left)):
                value = _constant(other, constants)
                if isinstance(one, Variable) and value is not None:
                    yield one.name, value


def _constant(tree: ExpressionNode, constants: Mapping[str, Value]) -> Value:
    match tree:
        case Flag(value=flag):
            return flag
        case Text(value=text) | Word(name=text):
            return text
        case Minus(operand=operand):
            number = number_in(operand, constants)
            return None if number is None else -number
    return number_in(tree, constants)
