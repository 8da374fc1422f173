"""From an argument as written to the function that computes its value."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.text import parse_template
from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.expressions.values import Value, is_named_pose
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.missions.engine.task import Task
from rbxcompose.missions.language.literals import literal
from rbxcompose.missions.language.spans import expression_of
from rbxcompose.missions.program.results import NodeFailed

Getter = Callable[[Task], Value]
PLACED = (TypeKind.PLACE, TypeKind.POSE)


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
    return found


def _word(value: Value) -> Value:
    """Return a choice as text, even if a place has the same name."""
    return value.name if is_named_pose(value) else value
