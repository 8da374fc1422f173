"""Conversion of values that YAML cannot write to the types that strict fields require."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydantic_core import ErrorDetails

from rbxcompose.manifest.tree import KeyPath, ScalarNode, TreeNode, at
from rbxcompose.units import Quantity, format_quantity


def place_of(node: TreeNode, error: ErrorDetails) -> KeyPath:
    """Return the place of an error in the tree, without pydantic's own steps, such as members of a union."""
    found: KeyPath = ()
    for step in error["loc"]:
        if at(node, (*found, step)) is not None:
            found = (*found, step)
    if error["type"] == "missing":
        found = (*found, error["loc"][-1])
    return found


def repaired(data: Any, error: ErrorDetails, node: TreeNode) -> Any:
    """Return `data` with one value converted to what a strict field requires: a number to text, a list to a tuple."""
    path, convert = place_of(node, error), _REPAIRS.get(error["type"])
    if convert is None:
        return data
    try:
        return changed(data, path, lambda value: convert(value, at(node, path)))
    except (KeyError, IndexError, TypeError):  # the place is not in the data, such as a missing key
        return data


def changed(data: Any, path: KeyPath, convert: Callable[[object], object]) -> Any:
    """Return `data` with the value at `path` converted; the same object if the value stays the same."""
    if not path:
        return convert(data)
    key = path[0]
    inner = changed(data[key], path[1:], convert)
    if inner is data[key]:
        return data
    if isinstance(data, dict):
        return {**data, key: inner}
    return type(data)(inner if index == key else item for index, item in enumerate(data))


def _as_text(value: object, node: TreeNode | None) -> object:
    if isinstance(value, Quantity):
        return format_quantity(value.value, value.dimension)
    if isinstance(node, ScalarNode) and node.filled is None and value is not None:
        return node.text
    return str(value) if isinstance(value, int | float) else value


def _as_tuple(value: object, _node: TreeNode | None) -> object:
    return tuple(value) if isinstance(value, list) else value


_REPAIRS: dict[str, Callable[[object, TreeNode | None], object]] = {"string_type": _as_text, "tuple_type": _as_tuple}
