"""Nodes in a mission's data: which ones a `run` may get, and the values that represent them."""

from collections.abc import Iterator, Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression, ExpressionNode, FieldAccess, Index, Variable
from rbxcompose.base.expressions.values import Value
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode

ANY = None  # matches any entry of a list or a map
ITEM = ""  # matches any item of a list in a loop; over a map, a loop iterates over the keys
NodeKey = tuple[str, ...]  # where a node is in the data: ("chores", "kitchen", "0")
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
            return None if inner is None else (*inner, ANY)
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
        if first in (ANY, name) or (first == ITEM and isinstance(node, SequenceNode)):
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


def with_held(value: Value, nodes: Mapping[NodeKey, TreeNode], key: NodeKey) -> Value:
    """Return a value of the data, at this key, with its nodes replaced by `HeldNode`s."""
    if key in nodes:
        return HeldNode(key, brief(nodes[key]))
    if isinstance(value, dict):
        return {name: with_held(entry, nodes, (*key, name)) for name, entry in value.items()}
    if isinstance(value, list):
        return [with_held(entry, nodes, (*key, str(index))) for index, entry in enumerate(value)]
    return value
