"""Values and triggers: what a `$name` of the missions refers to; conditions, messages and inputs of triggers."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from rbxcompose.base.expressions.tree import Expression, ExpressionError
from rbxcompose.base.expressions.types import FLAG, TYPES, UNKNOWN, Type, TypeKind, choice_of, quantity_of
from rbxcompose.base.findings import Finding
from rbxcompose.base.levels import Level
from rbxcompose.base.units import UNITS, Quantity
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent, RobotMission, places_of, resolve
from rbxcompose.compiler.sections.missions import TriggerModel, triggers
from rbxcompose.compiler.sections.values import ValueModel
from rbxcompose.manifest.shapes import exact
from rbxcompose.manifest.tree import BROKEN, ScalarNode, at, entries_of
from rbxcompose.missions import codes
from rbxcompose.missions.analysis.examined import base_scope, findings_of
from rbxcompose.missions.engine.inputs import bind_inputs
from rbxcompose.missions.engine.world import Watched
from rbxcompose.missions.execution.equipment import TRIGGER
from rbxcompose.missions.program.parts import expression_of, inner_span
from rbxcompose.missions.program.program import Program
from rbxcompose.missions.sources import ValueSource
from rbxcompose.missions.triggers.trigger import Trigger
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldShape, FieldType
from rbxcompose.msgs.fields import NoFieldError, field_type
from rbxcompose.sdk.ports import In, Out, Qos

# The message for data from outside whose type nothing in the robot declares.
STANDARD = {"text": "std_msgs/msg/String", "flag": "std_msgs/msg/Bool", "count": "std_msgs/msg/Int32"}
NUMBER = "std_msgs/msg/Float32"
LEVELS_TOPIC, LEVELS_TYPE = "/diagnostics_agg", "diagnostic_msgs/msg/DiagnosticArray"
LEVEL_WORDS = tuple(level.name.lower() for level in Level)
DATA = "data"  # the field of the standard messages


def value_of(
    entry: ValueModel,
    components: Mapping[str, RobotComponent],
    types: Mapping[str, str],
    namespace: str,
    levels: Mapping[str, str],
) -> ValueSource | None:
    """Return what a value refers to, None if its source does not exist (a check reports that).

    `types` are the ROS types of the robot's topics; `levels` are the statuses whose levels are values, too, by
    what `port` names.
    """
    if entry.port is not None:
        if (status := levels.get(entry.port)) is not None:
            return ValueSource(LEVELS_TOPIC, LEVELS_TYPE, "level", type=choice_of(*LEVEL_WORDS), group=status)
        component, _, port = entry.port.partition(".")
        end = components[component].end(port) if component in components else None
        return _of_port(end, entry) if end else None
    if entry.topic is None:
        return None
    topic = resolve(entry.topic, namespace)
    message = types.get(topic) or STANDARD.get(entry.type or "", NUMBER)
    return _value(topic, message, entry.field or DATA, entry.unit or "", TYPES.get(entry.type or ""), entry.event)


def _of_port(end: PortEnd, entry: ValueModel) -> ValueSource | None:
    port = end.port
    if not isinstance(port, Out | In):
        return None
    fields = tuple(registry.message(end.type_name).FIELDS)
    if len(fields) != 1:
        return None  # a whole message is not a value
    found = _value(end.topic, end.type_name, fields[0], entry.unit or port.unit, None, entry.event)
    return replace(found, is_latched=port.qos is Qos.LATCHED)


def _value(
    topic: str, message: str, field: str, unit: str, declared: Type | None, is_event: bool | None
) -> ValueSource:
    known = UNITS.get(unit)
    times, per = (known.times, known.per) if known else (1.0, 1.0)
    measured = quantity_of(known.dimension) if known else _plain_type(message, field)
    return ValueSource(topic, message, field, times, per, declared or measured, is_event=bool(is_event))


def _plain_type(message: str, field: str) -> Type:
    try:
        ros = field_type(message, field)
    except NoFieldError:  # a check reports it
        return UNKNOWN
    fitting = fitting_kinds(ros)
    if not fitting:
        return UNKNOWN
    plain = {TypeKind.TEXT: TYPES["text"], TypeKind.FLAG: TYPES["flag"]}
    return plain.get(fitting[0], TYPES["number"])


def fitting_kinds(field: FieldType) -> tuple[TypeKind, ...]:
    """Return the kinds of values that a field may be; none for messages and lists."""
    if field.is_message or field.shape is not FieldShape.SINGLE:
        return ()
    if field.base == "string":
        return (TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE)
    return (TypeKind.FLAG,) if field.base == "bool" else (TypeKind.QUANTITY, TypeKind.COUNT)


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
    entries = entries_of(at(robot.manifest.root, ("triggers", name, "with")))
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
    entries = entries_of(at(robot.manifest.root, ("triggers", name, "with")))
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
