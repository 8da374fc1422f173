"""What a node sets and sends, by itself or in its hooks."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Expression, Field, Index, Variable
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions.kinds.for_ import ForOptions
from rbxcompose.missions.messages import CALL, Message
from rbxcompose.missions.moments import Deeds, Moments
from rbxcompose.missions.program import Assignment, Node, Program


def assignments(node: Node) -> Iterator[Assignment]:
    """Yield what a node sets."""
    if isinstance(node.options, tuple):
        yield from (one for one in node.options if isinstance(one, Assignment))
    for deeds in _deeds(node):
        yield from deeds.assignments


def published(node: Node) -> Iterator[Message]:
    """Yield the messages that a node publishes."""
    if isinstance(node.options, Message) and node.kind != CALL:
        yield node.options
    yield from (deeds.message for deeds in _deeds(node) if deeds.message)


def called(node: Node) -> Iterator[Message]:
    """Yield the request that a node makes."""
    if isinstance(node.options, Message) and node.kind == CALL:
        yield node.options


def replaced(program: Program) -> frozenset[str]:
    """Return the names of all data that get other values while a mission runs."""
    return program.saved.union(one.name for node in program.nodes for one in assignments(node))


def written(program: Program) -> frozenset[str]:
    """Return the names of all data that change while a mission runs, also those that only lose items."""
    return replaced(program).union(*(shortened(node) for node in program.nodes))


def shortened(node: Node) -> frozenset[str]:
    """Return the name of the data that a loop takes its items from, if it removes those that are done."""
    options = node.options
    if not isinstance(options, ForOptions) or not options.removes_done or not isinstance(options.items, Expression):
        return frozenset()
    tree = options.items.tree
    while isinstance(tree, Field | Index):
        tree = tree.of
    return frozenset({tree.name} if isinstance(tree, Variable) else ())


def saved_name(node: Node) -> Scalar | None:
    """Return the name under which a node keeps its result."""
    name = node.modifiers.get("save")
    return name if isinstance(name, Scalar) and name.text else None


def _deeds(node: Node) -> Iterator[Deeds]:
    for value in node.modifiers.values():
        if isinstance(value, Moments):
            yield from value.deeds.values()
