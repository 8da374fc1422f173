"""The located tree as data for JSON, and back: a plan keeps a mission as the tree that it was read from."""

from typing import Any

from rbxcompose.base.findings import Span
from rbxcompose.base.units import DIMENSIONS, Dimension, Quantity
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode


def dimension_to_data(dimension: Dimension) -> str | dict[str, Any]:
    """Return the name of a dimension, if it has its own, else the name with the exponents."""
    if DIMENSIONS.get(dimension.name) == dimension:
        return dimension.name
    return {"name": dimension.name, "exponents": list(dimension.exponents)}


def dimension_of_data(data: Any) -> Dimension:
    """Return the dimension that `dimension_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    if isinstance(data, str):
        return DIMENSIONS[data]
    return Dimension(str(data["name"]), tuple(map(int, data["exponents"])))


def quantity_to_data(quantity: Quantity) -> dict[str, Any]:
    """Return the value in SI with its dimension."""
    return {"value": quantity.value, "dimension": dimension_to_data(quantity.dimension)}


def quantity_of_data(data: Any) -> Quantity:
    """Return the quantity that `quantity_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    return Quantity(float(data["value"]), dimension_of_data(data["dimension"]))


def node_to_data(node: TreeNode, file: str = "") -> dict[str, Any]:
    """Return a node as data; default values are left out, and `file` is that of the node around it."""
    data = _place(node.span, file)
    match node:
        case ScalarNode():
            data["text"] = node.text
            if not node.plain:
                data["quoted"] = True
            if node.filled is not None:
                data["filled"] = quantity_to_data(node.filled) if isinstance(node.filled, Quantity) else node.filled
            if node.scope:
                data["scope"] = node.scope
            return data
        case SequenceNode():
            data["items"] = [node_to_data(item, node.span.file) for item in node.items]
        case MappingNode():
            data["entries"] = [
                [node_to_data(one, node.span.file) for one in (entry.key, entry.value)]
                for entry in node.entries.values()
            ]
    if node.tag:
        data["tag"] = node.tag
    return data


def node_of_data(data: Any, file: str = "") -> TreeNode:
    """Return the node that `node_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    span = _span(data, file)
    if "entries" in data:
        pairs = [(_scalar(key, span.file), node_of_data(value, span.file)) for key, value in data["entries"]]
        return MappingNode({key.text: Entry(key, value) for key, value in pairs}, span, str(data.get("tag", "")))
    if "items" in data:
        items = tuple(node_of_data(item, span.file) for item in data["items"])
        return SequenceNode(items, span, str(data.get("tag", "")))
    return _scalar(data, file)


def _scalar(data: Any, file: str) -> ScalarNode:
    filled = data.get("filled")
    if isinstance(filled, dict):
        filled = quantity_of_data(filled)
    elif not isinstance(filled, bool | int | float | str | None):
        raise ValueError("a value must be a number, a flag or a text")
    return ScalarNode(
        text=str(data["text"]),
        span=_span(data, file),
        plain=not data.get("quoted", False),
        filled=filled,
        scope=str(data.get("scope", "")),
    )


def _place(span: Span, file: str) -> dict[str, Any]:
    data: dict[str, Any] = {"at": [span.line, span.column, span.end_line, span.end_column]}
    return data if span.file == file else {"file": span.file, **data}


def _span(data: Any, file: str) -> Span:
    line, column, end_line, end_column = map(int, data["at"])
    return Span(str(data.get("file", file)), line, column, end_line, end_column)
