"""Nodes in a mission's data: which ones a `run` may meet, and the values that represent them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rbxcompose.expressions.tree import Expression, Field, Index, Variable
from rbxcompose.expressions.tree import Node as Tree
from rbxcompose.expressions.values import Value
from rbxcompose.manifest.tree import Mapping as LocatedMapping
from rbxcompose.manifest.tree import Node as Located
from rbxcompose.manifest.tree import Scalar, Sequence

ANY = None  # stands for any entry of a list or a map
ITEM = ""  # stands for any item of a list that a loop goes through; of a map it goes through the keys
Key = tuple[str, ...]  # where a node stands in the data: ("chores", "kitchen", "0")
Pattern = tuple[str | None, ...]


@dataclass(frozen=True, slots=True)
class HeldNode:
    """A value that is a node of the mission; `text` is how it is shown."""

    key: Key
    text: str

    def __str__(self) -> str:
        return self.text


def pattern_of(expression: Expression, items: Mapping[str, Pattern]) -> Pattern | None:
    """Return where in the data an expression looks; `items` are the patterns of the loops' items. None: nowhere."""
    return _pattern(expression.tree, items)


def _pattern(tree: Tree, items: Mapping[str, Pattern]) -> Pattern | None:
    match tree:
        case Variable(name=name):
            return items.get(name, (name,))
        case Index(of=operand):
            inner = _pattern(operand, items)
            return None if inner is None else (*inner, ANY)
        case Field(of=operand, name=name):
            inner = _pattern(operand, items)
            return None if inner is None else (*inner, name)
    return None


def matching(data: Mapping[str, Located], pattern: Pattern) -> Iterator[tuple[Key, Located]]:
    """Yield what stands in the data at places of a pattern, with its key."""
    name = pattern[0] or ""
    if name in data:
        yield from _below((name,), data[name], pattern[1:])


def _below(key: Key, node: Located, pattern: Pattern) -> Iterator[tuple[Key, Located]]:
    if not pattern:
        yield key, node
        return
    first, rest = pattern[0], pattern[1:]
    for name, entry in _entries(node):
        if first in (ANY, name) or (first == ITEM and isinstance(node, Sequence)):
            yield from _below((*key, name), entry, rest)


def _entries(node: Located) -> Iterator[tuple[str, Located]]:
    if isinstance(node, LocatedMapping):
        yield from ((name, entry.value) for name, entry in node.entries.items())
    elif isinstance(node, Sequence):
        yield from ((str(index), item) for index, item in enumerate(node.items))


def brief(node: Located) -> str:
    """Return a node as people would say it: `mop 7 s`."""
    match node:
        case Scalar(text=text):
            return text
        case LocatedMapping(entries=entries) if entries:
            name, entry = next(iter(entries.items()))
            return f"{name} {brief(entry.value)}".strip() if isinstance(entry.value, Scalar) else name
        case Sequence(items=items):
            return ", ".join(brief(item) for item in items[:3])
    return ""


def with_held(value: Value, nodes: Mapping[Key, Located], key: Key) -> Value:
    """Return a value of the data, at this key, with `HeldNode`s where nodes stand."""
    if key in nodes:
        return HeldNode(key, brief(nodes[key]))
    if isinstance(value, dict):
        return {name: with_held(entry, nodes, (*key, name)) for name, entry in value.items()}
    if isinstance(value, list):
        return [with_held(entry, nodes, (*key, str(index))) for index, entry in enumerate(value)]
    return value
