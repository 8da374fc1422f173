"""The triggers of a robot: their conditions as expressions, the types of their messages, their inputs as text."""

from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.base.expressions.tree import Expression, ExpressionError
from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.findings import Finding
from rbxcompose.base.units import Quantity
from rbxcompose.compiler.composition.dump import exact
from rbxcompose.compiler.model.robot import Robot, RobotMission, places_of, resolve
from rbxcompose.compiler.sections.triggers import TriggerModel, triggers
from rbxcompose.manifest.tree import BROKEN, MappingNode, ScalarNode, at
from rbxcompose.missions import codes
from rbxcompose.missions.analysis.examined import base_scope, findings_of
from rbxcompose.missions.engine.inputs import bind_inputs
from rbxcompose.missions.engine.world import Watched
from rbxcompose.missions.execution.equipment import TRIGGER
from rbxcompose.missions.program.parts import expression_of, inner_span
from rbxcompose.missions.program.program import Program
from rbxcompose.missions.triggers.trigger import Trigger
from rbxcompose.msgs import registry

_NO_MISSION = Program("", "", "", ())


def triggers_of(robot: Robot) -> dict[str, Trigger]:
    """Return the triggers that could be read, by name."""
    found = {name: _trigger(robot, name, model) for name, model in robot.manifest.contents.of(triggers).items()}
    return {name: one for name, one in found.items() if one is not None}


def _trigger(robot: Robot, name: str, model: TriggerModel) -> Trigger | None:
    condition, findings = condition_of(robot, name)
    message = message_of(robot, model)
    if model.mission not in robot.missions or findings or (model.when and not condition):
        return None
    if model.message and not is_type(message):
        return None
    return Trigger(
        name,
        model.mission,
        model.cause,
        _inputs(robot, name),
        model.priority,
        model.running,
        model.schedule,
        Watched.of(condition) if condition else None,
        model.message or "",
        message,
        bool(model.at_start),
        model.ends or "",
        model.outcome or "",
    )


def condition_of(robot: Robot, name: str) -> tuple[Expression | None, list[Finding]]:
    """Return the condition of a trigger, if it has one, and the findings about it."""
    scalar = at(robot.manifest.root, ("triggers", name, "when"))
    if not isinstance(scalar, ScalarNode) or scalar.filled is BROKEN:
        return None, []
    try:
        expression = expression_of(scalar)
    except ExpressionError as error:
        span = inner_span(scalar, error.start, error.end)
        return None, [codes.NO_EXPRESSION.at(span, error.message, help=error.help)]
    scope = base_scope(_NO_MISSION, robot.names)
    return expression, list(findings_of(expression, FLAG, scalar, scope, codes.WRONG_TYPE))


def message_of(robot: Robot, model: TriggerModel) -> str:
    """Return the ROS type of the messages on the topic of a trigger; empty if it has none, or the type is unknown."""
    if model.type:
        return registry.full_name(model.type, "msg")
    topic = resolve(model.message, robot.manifest.bus.namespace or "") if model.message else ""
    ends = [*robot.writers.get(topic, ()), *robot.readers.get(topic, ())]
    return next((end.type_name for end in ends if not end.name.startswith(TRIGGER)), "")


def is_type(message: str) -> bool:
    """Return whether there is such a type of messages."""
    try:
        registry.message(message)
    except KeyError:
        return False
    return True


def findings_about(robot: Robot) -> Iterator[Finding]:
    """Yield the findings about the conditions of triggers, and about the inputs that they give."""
    for name, model in robot.manifest.contents.of(triggers).items():
        yield from condition_of(robot, name)[1]
        if model.mission in robot.missions:
            yield from _about_inputs(robot, name, robot.missions[model.mission])


def _about_inputs(robot: Robot, name: str, mission: RobotMission) -> Iterator[Finding]:
    given = at(robot.manifest.root, ("triggers", name, "with"))
    entries = given.entries if isinstance(given, MappingNode) else {}
    open_inputs = {
        key: one for key, one in mission.program.inputs.items() if key in entries or key not in mission.inputs
    }
    for key, entry in entries.items():
        if not isinstance(entry.value, ScalarNode) and key in open_inputs:
            message = f"a trigger cannot give the input '{key}' a list or a map"
            yield codes.WRONG_INPUT.at(entry.value.span, message, help=f"write it under 'missions: {mission.name}'")
            return
    removed = robot.manifest.history.removed("places")
    program = replace(mission.program, inputs=open_inputs)
    place = robot.key("triggers", name)
    yield from bind_inputs(program, entries, places_of(robot.manifest), place, removed)[1]


def _inputs(robot: Robot, name: str) -> dict[str, str]:
    """Return the inputs that a trigger gives, as people write them."""
    given = at(robot.manifest.root, ("triggers", name, "with"))
    entries = given.entries if isinstance(given, MappingNode) else {}
    return {key: _text(entry.value) for key, entry in entries.items() if isinstance(entry.value, ScalarNode)}


def _text(scalar: ScalarNode) -> str:
    match scalar.filled:
        case None:
            return scalar.text
        case Quantity(value=value, dimension=dimension):
            return exact(value, dimension)
        case bool() as flag:
            return str(flag).lower()
    return str(scalar.filled)
