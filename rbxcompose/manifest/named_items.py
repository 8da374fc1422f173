"""A list where entries need names: what each would be called."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.printable import plain

NAME = "name"
_MOST_SHOWN = 3
_LONGEST = 60
_NO_NAME = re.compile(r"[^a-z0-9_]+|^[^a-z]+")


def name_of(item: TreeNode) -> str:
    """Return the name that an item of a list probably has: that under `name`, or that of the file that it names."""
    match item:
        case MappingNode(entries=entries) if len(entries) == 1:
            (name,) = entries
            inner = entries[name].value
            return name_of(inner) if isinstance(inner, ScalarNode) else name
        case MappingNode(entries=entries):
            named = item.get(NAME) or next((entry.value for entry in entries.values() if _is_path(entry.value)), None)
            return name_of(named) if isinstance(named, ScalarNode) else ""
        case ScalarNode(text=text):
            return _NO_NAME.sub("_", PurePosixPath(text.replace("\\", "/")).stem.lower()).strip("_")
    return ""


def entry_of(item: TreeNode) -> TreeNode:
    """Return what an item is below its name."""
    if not isinstance(item, MappingNode):
        return item
    if len(item.entries) == 1 and not isinstance(only := next(iter(item.entries.values())).value, ScalarNode):
        return only
    return MappingNode({key: one for key, one in item.entries.items() if key != NAME}, item.span)


def help_with_names(node: TreeNode | None) -> str:
    """Return what to write instead of a list, or of a single file, where entries need names; empty for others."""
    match node:
        case ScalarNode() if _is_path(node) and name_of(node):
            return f"it needs a name: write '{name_of(node)}: {_shown(node)}' below it"
        case SequenceNode(items=items) if items and all(map(name_of, items)):
            shown = " and ".join(f"'{name_of(one)}:{_rest(one)}'" for one in items[:_MOST_SHOWN])
            rest = f", and so on for {len(items) - _MOST_SHOWN} more" if len(items) > _MOST_SHOWN else ""
            return f"each needs a name instead of its dash: {shown}{rest}"
        case SequenceNode():
            return "each needs a name instead of its dash: 'NAME:'"
    return ""


def _rest(item: TreeNode) -> str:
    return f" {_shown(item)}" if isinstance(item, ScalarNode) else ""


def _shown(scalar: ScalarNode) -> str:
    return plain(scalar.text, _LONGEST)


def _is_path(node: TreeNode) -> bool:
    return isinstance(node, ScalarNode) and "." in node.text and " " not in node.text
