"""Literal values in a manifest: of the type that is wanted, poses that are written out, nodes in the data."""

import math
from collections.abc import Collection, Container, Iterator, Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import types
from rbxcompose.base.expressions.tree import Expression, ExpressionNode, FieldAccess, Index, Variable
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import DID_YOU_MEAN, Finding, FindingKind, Span, surely_meant
from rbxcompose.base.printable import plain
from rbxcompose.base.units import MOST, NUMBER, Quantity, UnitError, number_and_unit, parse_quantity, to_si
from rbxcompose.manifest.tree import (
    Key,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    children,
    describe,
    plain_value,
)
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.program.parts import Datum, Input


class WrongValue(ValueError):  # noqa: N818 - a user's mistake, told apart from errors of ours
    """Raised when a value does not have its type; `label` says what it is instead, `help` what to do."""

    def __init__(self, message: str, *, label: str = "", help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.label = label
        self.help = help

    def finding(self, kind: FindingKind, span: Span, what: str) -> Finding:
        """Return the finding on this value; `what` is the subject of its message."""
        return kind.at(span, f"{what} {self.message}", label=self.label, help=self.help)


NodeKey = tuple[str, ...]  # where a node is in the data: ("chores", "kitchen", "0")


def literal(node: TreeNode, held: Container[NodeKey] = (), key: NodeKey = ()) -> Datum:
    """Return the literal in a node: a number in SI, a flag, a text, a list or a map of these.

    In the data, at this key, those that are `held` become a `HeldNode`.
    """
    if key in held:
        return Datum(HeldNode(key, brief(node)), types.STEP, node.span)
    match node:
        case MappingNode(entries=entries):
            values = {name: literal(entry.value, held, (*key, name)) for name, entry in entries.items()}
            found = types.map_with({name: datum.type for name, datum in values.items()})
            return Datum({name: datum.value for name, datum in values.items()}, found, node.span)
        case SequenceNode(items=items):
            read = [literal(item, held, (*key, str(index))) for index, item in enumerate(items)]
            return Datum([datum.value for datum in read], types.list_with([datum.type for datum in read]), node.span)
        case ScalarNode():
            value = node.filled if node.filled is not None else _measured(node)
            return Datum(*_typed(value), node.span)


def typed(node: TreeNode, wanted: types.Type) -> Datum:
    """Return the literal in a node as a value of the type `wanted`; places stay texts.

    Raises:
        WrongValue: if it does not have that type.
    """
    if wanted.kind in (types.TypeKind.LIST, types.TypeKind.MAP):
        found = literal(node)
        if not types.accepts(wanted, found.type):
            is_other = found.type.kind is not wanted.kind
            said = (wanted.phrase, found.type.phrase) if is_other else (wanted.detail, found.type.detail)
            raise WrongValue(f"must be {said[0]}", label=f"this is {said[1]}")
        return found
    if wanted == types.STEP:
        raise WrongValue("is a step from the data, which only the mission sets")
    if not isinstance(node, ScalarNode):
        raise WrongValue(f"must be {wanted.phrase}", label=describe([] if isinstance(node, SequenceNode) else {}))
    return Datum(_scalar(node, wanted), wanted, node.span)


def _scalar(scalar: ScalarNode, wanted: types.Type) -> Value:
    value = plain_value(scalar) if scalar.filled is None else scalar.filled
    label = "" if isinstance(value, Quantity) else describe(value)
    if wanted.dimension:
        try:
            return to_si(value, wanted.dimension)
        except UnitError as error:
            raise WrongValue(error.message, label=error.detail or label, help=error.help) from None
    if wanted.kind is types.TypeKind.COUNT:
        count = value.value if isinstance(value, Quantity) else value
        if isinstance(count, bool) or not isinstance(count, int | float) or count < 0 or count != int(count):
            raise WrongValue("must be a whole number, at least 0", label=label)
        if count >= MOST:
            raise WrongValue("must be below 1e15", label=label)
        return float(count)
    if wanted.kind is types.TypeKind.FLAG:
        if not isinstance(value, bool):
            raise WrongValue("must be true or false", label=label)
        return value
    text = scalar.text if scalar.filled is None else str(scalar.filled)
    if wanted.kind is types.TypeKind.CHOICE and text not in wanted.choices:
        choices = ", ".join(wanted.choices)
        near = surely_meant(text, wanted.choices)
        help_text = f"{DID_YOU_MEAN} '{near}'?" if near else f"choices: {choices}"
        raise WrongValue(f"is not one of the choices: '{text}'", help=help_text)
    return text


def _measured(scalar: ScalarNode) -> object:
    value = plain_value(scalar)
    if isinstance(value, str) and scalar.plain:
        try:
            return parse_quantity(value)
        except UnitError:
            return value
    return "" if value is None else value


def _typed(value: object) -> tuple[Value, types.Type]:
    match value:
        case Quantity(value=number, dimension=dimension):
            return number, types.quantity_of(dimension)
        case bool():
            return value, types.FLAG
        case int():
            return float(value), types.COUNT
        case float():
            return value, types.quantity_of(NUMBER)
        case _:
            return str(value), types.TEXT


MAP = "map"
_FRAMES = ("frame", "frame_id")
_COORDINATES: Mapping[str, tuple[str, str]] = {  # ours, and the unit of a bare number in messages of ROS
    **{"x": ("x", "m"), "y": ("y", "m")},
    **dict.fromkeys(("heading", "theta", "yaw"), ("heading", "rad")),
}
_AROUND = ("header", "orientation", "point", "pose", "position", "translation", "z")
_ORDER = ("x", "y", "heading")
POSE_WORDS = frozenset((*_FRAMES, *_COORDINATES, *_AROUND))
"""Keys of a pose that is written out."""


def is_pose(keys: Collection[str]) -> bool:
    """Return whether keys are those of a pose, a point, or what messages have around them."""
    return bool(keys) and POSE_WORDS.issuperset(keys)


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
            name, usual = _COORDINATES[key]
            try:
                number, unit = number_and_unit(scalar.text)
            except UnitError:
                continue
            if usual == "rad" and abs(float(number)) > math.tau:
                usual = "deg"  # nobody turns further than once
            yield name, f"{number} {unit or usual}"


ANY_ENTRY = None  # matches any entry of a list or a map
ITEM = ""  # matches any item of a list in a loop; over a map, a loop iterates over the keys
PathPattern = tuple[str | None, ...]


@dataclass(frozen=True, slots=True)
class HeldNode:
    """A value that is a node of the mission; `text` is how it is shown."""

    key: NodeKey
    text: str

    def __str__(self) -> str:
        return self.text


def pattern_of(expression: Expression, items: Mapping[str, PathPattern]) -> PathPattern | None:
    """Return where in the data an expression points, None for nowhere; `items` are the patterns of the loops' items."""
    return _pattern(expression.tree, items)


def _pattern(tree: ExpressionNode, items: Mapping[str, PathPattern]) -> PathPattern | None:
    match tree:
        case Variable(name=name):
            return items.get(name, (name,))
        case Index(of=operand):
            inner = _pattern(operand, items)
            return None if inner is None else (*inner, ANY_ENTRY)
        case FieldAccess(of=operand, name=name):
            inner = _pattern(operand, items)
            return None if inner is None else (*inner, name)
    return None


def matching(data: Mapping[str, TreeNode], pattern: PathPattern) -> Iterator[tuple[NodeKey, TreeNode]]:
    """Yield the parts of the data that match a pattern, each with its key."""
    name = pattern[0] or ""
    if name in data:
        yield from _below((name,), data[name], pattern[1:])


def _below(key: NodeKey, node: TreeNode, pattern: PathPattern) -> Iterator[tuple[NodeKey, TreeNode]]:
    if not pattern:
        yield key, node
        return
    first, rest = pattern[0], pattern[1:]
    for name, entry in _entries(node):
        if first in (ANY_ENTRY, name) or (first == ITEM and isinstance(node, SequenceNode)):
            yield from _below((*key, name), entry, rest)


def _entries(node: TreeNode) -> Iterator[tuple[str, TreeNode]]:
    if isinstance(node, MappingNode):
        yield from ((name, entry.value) for name, entry in node.entries.items())
    elif isinstance(node, SequenceNode):
        yield from ((str(index), item) for index, item in enumerate(node.items))


def brief(node: TreeNode) -> str:
    """Return a node as people would say it: `mop 7 s`."""
    match node:
        case ScalarNode(text=text):
            return text
        case MappingNode(entries=entries) if entries:
            name, entry = next(iter(entries.items()))
            return f"{name} {brief(entry.value)}".strip() if isinstance(entry.value, ScalarNode) else name
        case SequenceNode(items=items):
            return ", ".join(brief(item) for item in items[:3])
    return ""


def range_trouble(declared: Input, given: Datum) -> str:
    """Return why a value is out of the range of its input, as words that follow its name; else nothing."""
    value = given.value
    if not isinstance(value, float):
        return ""
    if declared.least is not None and value < declared.least:
        return f"is below its 'min' of {show(declared.type, declared.least)}: {show(declared.type, value)}"
    if declared.most is not None and value > declared.most:
        return f"is above its 'max' of {show(declared.type, declared.most)}: {show(declared.type, value)}"
    return ""
