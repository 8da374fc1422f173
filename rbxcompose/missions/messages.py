"""Messages that a mission publishes, and requests that it makes: a topic or service, and what is in each field."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.text import Template
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions.task import NodeFailed
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import parse_type
from rbxcompose.msgs.types import Message as RosMessage

if TYPE_CHECKING:
    from rbxcompose.missions.program import Program
    from rbxcompose.missions.task import Task

TEXT = "string"
CALL = "call"  # the kind whose message is a request


@dataclass(frozen=True, slots=True)
class Written:
    """One value as it was written: a text with slots, and an expression if it can be read as one."""

    scalar: Scalar
    template: Template
    expression: Expression | None


Shape: TypeAlias = "Written | Mapping[str, Shape] | tuple[Shape, ...]"


@dataclass(frozen=True, slots=True)
class Message:
    """What is sent where; `body` is None for a message whose fields all keep their zero values.

    `keys` are the places of the names of fields, by the path to each.
    """

    target: Scalar
    body: Shape | None
    keys: Mapping[tuple[str, ...], Span] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Return all `$names` that it reads."""
        return frozenset(_names(self.body))

    def fields(self, message: type[RosMessage], task: Task) -> dict[str, Value]:
        """Return the fields by name, nested ones as maps; a single value stands for the only field.

        Raises:
            NodeFailed: if there is no such field.
        """
        body = self.body
        if body is None:
            return {}
        if not isinstance(body, Mapping):
            if len(message.FIELDS) != 1:
                raise NodeFailed(f"{message.TYPE} has several fields: name them")
            body = {next(iter(message.FIELDS)): body}
        return _fields(body, message, task)


def _names(shape: Shape | None) -> Iterator[str]:
    match shape:
        case Written():
            yield from (name.name for name in shape.template.names)
        case Mapping():
            for inner in shape.values():
                yield from _names(inner)
        case tuple():
            for inner in shape:
                yield from _names(inner)


def _fields(body: Mapping[str, Shape], message: type[RosMessage], task: Task) -> dict[str, Value]:
    found: dict[str, Value] = {}
    for name, shape in body.items():
        if name not in message.FIELDS:
            raise NodeFailed(f"{message.TYPE} has no field '{name}'")
        found[name] = _value(shape, message.FIELDS[name], task)
    return found


def _value(shape: Shape, ros_type: str, task: Task) -> Value:
    base = parse_type(ros_type).base
    if isinstance(shape, Mapping):
        return _fields(shape, registry.message(base), task)
    if isinstance(shape, tuple):
        return [_value(one, base, task) for one in shape]
    if base == TEXT:
        return task.run.written(shape.template, task.scope)
    if shape.expression is None:
        raise NodeFailed(f"'{shape.scalar.text}' is no value of the type {ros_type}")
    return evaluate(shape.expression, task.scope)


def sent_by(programs: Iterable[Program]) -> tuple[set[str], set[str]]:
    """Return the topics on which missions publish, and the services that they call, as they write them."""
    published: set[str] = set()
    called: set[str] = set()
    for node in (node for program in programs for node in program.nodes):
        if isinstance(node.options, Message):
            (called if node.kind == CALL else published).add(node.options.target.text)
        for value in node.modifiers.values():
            deeds = getattr(value, "deeds", {})  # of hooks
            published.update(one.message.target.text for one in deeds.values() if one.message)
    return published, called
