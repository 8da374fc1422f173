"""From an argument as written to the function that computes its value."""

from collections.abc import Callable, Collection, Iterator, Mapping

from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.text import parse_template
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.expressions.values import Value, is_located, is_named_pose
from rbxcompose.base.printable import plain
from rbxcompose.base.units import UnitError, parse_quantity
from rbxcompose.manifest.tree import Key, ScalarNode, SequenceNode, TreeNode, children
from rbxcompose.missions.engine.task import Task
from rbxcompose.missions.language.asked import expression_of
from rbxcompose.missions.language.literals import literal
from rbxcompose.missions.program.outcomes import NodeFailed

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
    if not is_located(found):
        raise NodeFailed(f"{task.run.show('', found)} is no place")
    return found


def _word(value: Value) -> Value:
    """Return a choice as text, even if a place has the same name."""
    return value.name if is_named_pose(value) else value


MAP = "map"
_FRAMES = ("frame", "frame_id")
_COORDINATES: Mapping[str, tuple[str, str]] = {  # ours, and the unit of a bare number in messages of ROS
    **{"x": ("x", "m"), "y": ("y", "m")},
    **dict.fromkeys(("heading", "theta", "yaw"), ("heading", "rad")),
}
_AROUND = ("header", "orientation", "point", "pose", "position", "translation", "z")
_ORDER = ("x", "y", "heading")
WORDS = frozenset((*_FRAMES, *_COORDINATES, *_AROUND))
"""Keys of a pose that is written out."""


def is_pose(keys: Collection[str]) -> bool:
    """Return whether keys are those of a pose, a point, or what messages have around them."""
    return bool(keys) and WORDS.issuperset(keys)


def help_with_place(nodes: Mapping[str, TreeNode]) -> str:
    """Return what to do with a pose that is written out: declare a place, with its own numbers."""
    found = dict(_coordinates(nodes))
    frame = next((frame for frame in _frames(nodes) if frame != MAP), "")
    shown = ", ".join(f"{name}: {found[name]}" for name in _ORDER if name in found)
    place = f"'NAME: {{{shown}}}'" if {"x", "y"} <= found.keys() else "a place"
    reason = f"there are no poses in '{plain(frame, 60)}', all are in '{MAP}': " if frame else ""
    return f"{reason}declare {place} under 'places' of the robot, and write its name"


def nodes_of(node: TreeNode) -> Mapping[str, TreeNode]:
    """Return what is below a node by its key; the items of a list are coordinates in their usual order."""
    if isinstance(node, SequenceNode):
        return dict(zip(_ORDER, node.items, strict=False))
    return {str(key): below for key, below in children(node)}


def _scalars(nodes: Mapping[str, TreeNode]) -> Iterator[tuple[str, ScalarNode]]:
    waiting: list[tuple[Key, TreeNode]] = list(nodes.items())
    while waiting:
        key, node = waiting.pop()
        if isinstance(node, ScalarNode):
            yield str(key), node
        waiting += children(node)


def _frames(nodes: Mapping[str, TreeNode]) -> Iterator[str]:
    return (scalar.text for key, scalar in _scalars(nodes) if key in _FRAMES)


def _coordinates(nodes: Mapping[str, TreeNode]) -> Iterator[tuple[str, str]]:
    """Yield the coordinates with their units, as far as they are numbers."""
    for key, scalar in _scalars(nodes):
        if key in _COORDINATES:
            name, unit = _COORDINATES[key]
            try:
                parse_quantity(scalar.text)
            except UnitError:
                continue
            is_bare = scalar.text.strip()[-1:].isdigit()
            yield name, f"{scalar.text.strip()} {unit}" if is_bare else scalar.text.strip()
