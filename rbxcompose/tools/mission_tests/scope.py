"""What the expressions of a test see, before and during its run; and how its values are written."""

from collections.abc import Iterator, Mapping

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.text import fill, parse_template
from rbxcompose.base.expressions.types import PLACED, POSE, STRUCTURED, UNKNOWN, Type, TypeKind
from rbxcompose.base.expressions.values import NotArrived, Value, is_named_pose, is_number, is_same
from rbxcompose.base.findings import Finding
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.missions.analysis.examined import NodeScope, View, check_written
from rbxcompose.missions.engine.world import POSE as POSE_NAME
from rbxcompose.missions.engine.world import RobotValues, show
from rbxcompose.missions.language.literals import WrongValue, literal, typed
from rbxcompose.missions.program.parts import expression_of
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.tools.mission_tests import codes
from rbxcompose.tools.mission_tests.model import ValueSetting

CLOSE = 1e-6  # relative difference up to which numbers are equal


class TrialScope:
    """The scope of a test: inputs of the mission or arguments of a call first, then the robot's values and places."""

    def __init__(self, known: Mapping[str, Value], places: Mapping[str, Place], values: RobotValues) -> None:
        self._known = known
        self._places = places
        self._values = values

    def variable(self, name: str) -> Value | NotArrived:
        """Return the value of a name."""
        return self._known[name] if name in self._known else self._values.value(name)

    def word(self, name: str) -> Value:
        """Return the place of this name, else the word itself."""
        return self._places.get(name, name)

    def age(self, name: str) -> float | NotArrived:
        """Return the time since the last message [s]."""
        return self._values.age(name)

    def is_new(self, name: str) -> bool:
        """Return whether any message has arrived."""
        return name not in self._known and self._values.count(name) > 0


def names_of(robot: RobotNames) -> Mapping[str, Type]:
    """Return the types of everything that a test can set: the robot's values, and the pose."""
    return {**robot.values, POSE_NAME: POSE}


def check_setting(
    node: TreeNode, wanted: Type, program: Program, robot: RobotNames, known: Mapping[str, Type]
) -> Iterator[Finding]:
    """Yield the findings on a value that a test assigns to a name of the type `wanted`."""
    if not isinstance(node, ScalarNode):
        if wanted.kind not in STRUCTURED and wanted != UNKNOWN:
            yield codes.WRONG_VALUE.at(node.span, f"this must be {wanted.phrase}")
        return
    scope = NodeScope({**names_of(robot), **known}, robot.places)
    yield from check_written(View(program, robot, program.nodes[program.main], scope), node, wanted, codes.WRONG_VALUE)


def setting_of(node: TreeNode, wanted: Type, robot: RobotNames) -> ValueSetting:
    """Return the function that computes a written value; only for a value without findings."""
    if not isinstance(node, ScalarNode):
        constant = literal(node).value
        return lambda scope: constant
    if wanted.kind is TypeKind.TEXT:
        template = parse_template(node.text)
        return lambda scope: fill(template, scope, lambda name, value: show(robot.values.get(name), value))
    expression = expression_of(node)
    if wanted.kind in PLACED:
        return lambda scope: _placed(evaluate(expression, scope), robot)
    if wanted.kind is TypeKind.CHOICE:
        return lambda scope: _word(evaluate(expression, scope))
    return lambda scope: evaluate(expression, scope)


def _placed(value: Value, robot: RobotNames) -> Value:
    return robot.places.get(value, value) if isinstance(value, str) else value


def _word(value: Value) -> Value:
    return value.name if is_named_pose(value) else value


def read_value(node: TreeNode, wanted: Type, robot: RobotNames, what: str) -> tuple[Value, list[Finding]]:
    """Return an expected value of the type `wanted`, and the findings on it."""
    if wanted == UNKNOWN:
        return literal(node).value, []
    try:
        value = typed(node, wanted).value
    except WrongValue as error:
        return None, [codes.WRONG_VALUE.at(node.span, f"{what} {error.message}", label=error.label, help=error.help)]
    if wanted.kind in PLACED and isinstance(value, str) and value not in robot.places:
        message = f"there is no place '{value}'"
        return value, [codes.UNKNOWN.misspelt(node.span, message, value, robot.places, "places of this robot")]
    return value, []


def agrees(expected: Value, happened: Value) -> bool:
    """Return whether a value is the expected one.

    Only the written entries of a map count; a map without entries expects an empty one.
    """
    if isinstance(expected, Mapping) and isinstance(happened, Mapping):
        if not expected:
            return not happened
        return all(name in happened and agrees(entry, happened[name]) for name, entry in expected.items())
    if isinstance(expected, list | tuple) and isinstance(happened, list | tuple):
        return len(expected) == len(happened) and all(map(agrees, expected, happened))
    if isinstance(expected, int | float) and isinstance(happened, int | float) and is_number(expected):
        close = CLOSE * max(1.0, abs(float(expected)))
        return is_number(happened) and abs(float(expected) - float(happened)) <= close
    return is_same(expected, happened) or str(happened) == expected
