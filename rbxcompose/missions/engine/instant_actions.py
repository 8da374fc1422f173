"""What a task does at once: compute arguments, publish messages, set and edit data, log."""

from collections.abc import Callable, Iterable, Mapping

from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.text import parse_template
from rbxcompose.base.expressions.tree import Expression, ExpressionNode, FieldAccess, Index, Variable
from rbxcompose.base.expressions.types import PLACED, Type, TypeKind
from rbxcompose.base.expressions.values import Value, is_located, is_named_pose, is_same
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.missions.engine.events import Logged, Published
from rbxcompose.missions.engine.task import Task
from rbxcompose.missions.engine.world import MissionScope
from rbxcompose.missions.language.literals import literal
from rbxcompose.missions.program.outcomes import NodeFailed
from rbxcompose.missions.program.parts import Assignment, Deeds, MessageTemplate, Moments, TemplateShape, expression_of
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import parse_type
from rbxcompose.msgs.types import Message


def without(target: ExpressionNode, item: Value, data: dict[str, Value], scope: MissionScope) -> None:
    """Remove an item from the list (the first equal one) or map (its key) that an expression names in the data.

    Raises:
        NodeFailed: if the expression names nothing in the data.
    """
    path = _path(target, scope)
    name = path[0]
    if name not in data:
        raise NodeFailed(f"'{name}' is not in the data, so nothing can be removed from it")
    data[str(name)] = _removed(data[str(name)], path[1:], item)


def _path(tree: ExpressionNode, scope: MissionScope) -> list[Value]:
    match tree:
        case Variable(name=name):
            return [name]
        case FieldAccess(of=of, name=name):
            return [*_path(of, scope), name]
        case Index(of=of, index=index):
            return [*_path(of, scope), evaluate(Expression("", index), scope)]
    raise NodeFailed("'remove_done' needs named data, such as '$chores'")


def _removed(value: Value, path: list[Value], item: Value) -> Value:
    if path:
        key, rest = path[0], path[1:]
        if isinstance(value, dict):
            return {name: _removed(entry, rest, item) if is_same(name, key) else entry for name, entry in value.items()}
        if isinstance(value, list) and isinstance(key, int | float) and key in range(len(value)):
            index = int(key)
            return [*value[:index], _removed(value[index], rest, item), *value[index + 1 :]]
        raise NodeFailed("there is nothing to remove from")
    if isinstance(value, dict):
        return {name: entry for name, entry in value.items() if not is_same(name, item)}
    if isinstance(value, list):
        found = next((at for at, one in enumerate(value) if is_same(one, item)), len(value))
        return [*value[:found], *value[found + 1 :]]
    raise NodeFailed("there is nothing to remove from")


TEXT = "string"


def fields_of(sent: MessageTemplate, message: type[Message], task: Task) -> dict[str, Value]:
    """Return the fields by name, nested ones as maps; a single value fills the only field.

    Raises:
        NodeFailed: if there is no such field.
    """
    body = sent.body
    if body is None:
        return {}
    if not isinstance(body, Mapping):
        if len(message.FIELDS) != 1:
            raise NodeFailed(f"{message.TYPE} has several fields: name them")
        body = {next(iter(message.FIELDS)): body}
    return _fields(body, message, task)


def _fields(body: Mapping[str, TemplateShape], message: type[Message], task: Task) -> dict[str, Value]:
    found: dict[str, Value] = {}
    for name, shape in body.items():
        if name not in message.FIELDS:
            raise NodeFailed(f"{message.TYPE} has no field '{name}'")
        found[name] = _value(shape, message.FIELDS[name], task)
    return found


def _value(shape: TemplateShape, ros_type: str, task: Task) -> Value:
    base = parse_type(ros_type).base
    if isinstance(shape, Mapping):
        return _fields(shape, registry.message(base), task)
    if isinstance(shape, tuple):
        return [_value(item, base, task) for item in shape]
    if base == TEXT:
        return task.run.written(shape.template, task.scope)
    if shape.expression is None:
        raise NodeFailed(f"'{shape.scalar.text}' is no value of the type {ros_type}")
    return evaluate(shape.expression, task.scope)


def publish(message: MessageTemplate, task: Task) -> None:
    """Publish a message; raises what its expressions raise, and ValueError if a field does not fit."""
    topic = message.target.text
    fields = fields_of(message, registry.message(task.engine.robot.topics[topic]), task)
    task.engine.world.publish(topic, fields)
    task.engine.say(Published(task.number, topic, fields))


def assign(assignments: Iterable[Assignment], task: Task) -> None:
    """Evaluate all right-hand sides, then set the data, and request another tick for what may depend on it."""
    task.run.data.update(
        {assignment.name: evaluate(assignment.asked.expression, task.scope) for assignment in assignments}
    )
    task.engine.again(task)


def act(moments: Moments, moment: str, task: Task) -> None:
    """Do what belongs to a moment; raises what its expressions raise, which fails the node."""
    if moment in moments.deeds:
        outcome = task.engine.outcome
        _do(moments.deeds[moment], task)
        task.engine.outcome = outcome


def act_safely(moments: Moments, moment: str, task: Task) -> None:
    """Do what belongs to a moment at which the node can no longer fail; report errors."""
    try:
        act(moments, moment, task)
    except Exception as error:  # the node is halted anyway
        task.report(error)


def _do(deeds: Deeds, task: Task) -> None:
    if deeds.assignments:
        assign(deeds.assignments, task)
    if deeds.text:
        task.engine.say(Logged(deeds.level, task.run.filled(deeds.text, task.scope)))
    if deeds.message:
        publish(deeds.message, task)


Getter = Callable[[Task], Value]


def getter(value: TreeNode, wanted: Type) -> Getter:
    """Return the function that computes an argument of the type `wanted` from its written value."""
    if not isinstance(value, ScalarNode):
        constant = literal(value).value
        return lambda task: constant
    if wanted.kind is TypeKind.TEXT:
        template = parse_template(value.text)
        return lambda task: task.run.filled(template, task.scope)
    expression = expression_of(value)
    if wanted.kind in PLACED:
        return lambda task: place(task, evaluate(expression, task.scope))
    if wanted.kind is TypeKind.CHOICE:
        return lambda task: _word(evaluate(expression, task.scope))
    return lambda task: evaluate(expression, task.scope)


def place(task: Task, value: Value) -> Value:
    """Return the place that a text names; return a place or a pose as it is."""
    found = task.engine.robot.places.get(value, value) if isinstance(value, str) else value
    if isinstance(found, str):
        raise NodeFailed(f"there is no place '{found}'")
    if not is_located(found):
        raise NodeFailed(f"{task.run.show('', found)} is no place")
    return found


def _word(value: Value) -> Value:
    """Return a choice as text, even if a place has the same name."""
    return value.name if is_named_pose(value) else value
