"""Values of ROS parameters as values of a manifest."""

from __future__ import annotations

from rbxcompose.importing.foreign_files import Given
from rbxcompose.importing.manifest_text import flag, flow_list, key, number, word
from rbxcompose.manifest.scalars import number_trouble, plain_value
from rbxcompose.manifest.tree import ScalarNode, SequenceNode, TreeNode
from rbxcompose.printable import FORBIDDEN
from rbxcompose.units import MOST

ParameterData = bool | int | float | str | list[bool | int | float | str]
_LONGEST = 10_000  # items of a list, as a manifest has them


def value_of(node: TreeNode) -> Given[ParameterData] | None:
    """Return the value of a parameter: a word, a number, or a list of such; None if it is none of these."""
    match node:
        case ScalarNode():
            value = _scalar(node)
        case SequenceNode(items=items) if len(items) <= _LONGEST:
            values = [_scalar(one) for one in items]
            value = None if None in values else [one for one in values if one is not None]  # type: ignore[assignment]
        case _:
            return None
    return None if value is None else Given(value, node.span)


def _scalar(node: TreeNode) -> bool | int | float | str | None:
    if not isinstance(node, ScalarNode) or is_told(node):
        return None
    value = plain_value(node)
    if isinstance(value, int | float) and not isinstance(value, bool) and not abs(value) < MOST:
        return None
    return value


def is_told(node: TreeNode) -> bool:
    """Return whether a value was refused when the file was read."""
    return isinstance(node, ScalarNode) and bool(number_trouble(node) or FORBIDDEN.search(node.text))


def argument_type(value: ParameterData) -> str:
    """Return the type of an argument that takes a value and others like it."""
    match value:
        case bool():
            return "flag"
        case int():
            return "count" if value >= 0 else "number"
        case float():
            return "number"
        case str():
            return "text"
    return "list"


def written(value: ParameterData) -> str:
    """Return a value as a manifest has it."""
    match value:
        case bool():
            return flag(value)
        case int():
            return str(value)
        case float():
            return number(value)
        case str():
            return word(value)
    return flow_list([written(one) for one in value])


def shown_name(path: tuple[str, ...]) -> str:
    """Return the name of a parameter as ROS 2 writes it."""
    return ".".join(key(one) for one in path)
