"""Values that missions give to settings."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.config import Config
from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.tree import ExpressionError
from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.expressions.values import EvaluationError, Value
from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.facts import Constants, constants_of
from rbxcompose.missions.language.argument_types import check_written
from rbxcompose.missions.language.spans import expression_of
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.rules import NAMES


@check("RBX7011", closed=(NAMES,))
def parameter_value(robot: Robot) -> Iterator[Finding]:
    """A mission gives a setting a value that it cannot have."""
    for mission in robot.missions.values():
        for view in Examined(mission.program, robot.names).views:
            setting = view.node.step.effects.setting
            if setting is None:
                continue
            wanted = robot.names.settings.get(setting.component.text, {}).get(setting.parameter.text)
            value = view.node.step.arguments[0].value
            if wanted is None or not isinstance(value, ScalarNode) or not value.text:
                continue
            found = list(check_written(view, value, wanted, parameter_value))
            known = constants_of(mission.program, mission.inputs)
            component = robot.components[setting.component.text]
            yield from found or _beyond(component, setting.parameter.text, value, wanted, known)


class _Constants:
    """What is known before the mission runs."""

    def __init__(self, known: Constants) -> None:
        self._known = known

    def variable(self, name: str) -> Value:
        """Return a value that nothing changes."""
        return self._known[name]

    def word(self, name: str) -> Value:
        """Know no places."""
        raise KeyError(name)

    def age(self, name: str) -> float:
        """Know no messages."""
        raise KeyError(name)

    def is_new(self, name: str) -> bool:
        """Know no messages."""
        raise KeyError(name)


def _beyond(
    component: RobotComponent, name: str, value: ScalarNode, wanted: Type, known: Constants
) -> Iterator[Finding]:
    """Yield the finding on a value that is known and that the component would refuse."""
    from rbxcompose.params.core import UnsettableError  # with messages that few robots need for a check

    try:
        config_with(component, name, value, wanted, known)
    except UnsettableError as error:
        yield parameter_value.at(value.span, f"'{component.name}' would refuse this: {error}")


def config_with(
    component: RobotComponent, name: str, value: ScalarNode, wanted: Type, known: Constants
) -> Config | None:
    """Return the configuration of a component with a setting as a mission writes it; None if that is not known.

    Raises:
        UnsettableError: if the component refuses the value.
    """
    if wanted.kind in (TypeKind.TEXT, TypeKind.CHOICE):
        return None  # its words are checked as its type
    try:
        given = evaluate(expression_of(value), _Constants(known))
    except (EvaluationError, ExpressionError, KeyError):
        return None
    from rbxcompose.msgs.rcl_interfaces import Parameter  # messages that few robots need for a check
    from rbxcompose.params.core import changed
    from rbxcompose.params.values import to_message

    message = to_message(given)
    return None if message is None else changed(component.config, [Parameter(name, message)], component.bounds)
