"""Edits of lists and maps in a mission's data; values held elsewhere stay unchanged."""

from __future__ import annotations

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.tree import Expression, ExpressionNode, FieldAccess, Index, Variable
from rbxcompose.expressions.values import Value, is_same
from rbxcompose.missions.engine.scopes import MissionScope
from rbxcompose.missions.program.results import NodeFailed


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
