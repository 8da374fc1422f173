"""Sections of the file that are indented below another one."""

from __future__ import annotations

from collections.abc import Collection

from rbxcompose.findings import Finding, nearest
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode
from rbxcompose.manifest.validate import UNKNOWN_KEY


def is_misplaced(entry: TreeNode, keys: Collection[str], own: Collection[str]) -> bool:
    """Return whether an entry with the name of a section is that section, and no entry of the section around it.

    `keys` are those of the section, none if it takes any name; `own` are those of an entry.
    """
    if not isinstance(entry, MappingNode) or not entry.entries:
        return False
    is_section = not keys or any(name in keys for name in entry.entries)
    return is_section and not any(nearest(name, own) for name in entry.entries)


def misplaced(key: ScalarNode, around: str) -> Finding:
    """Return the finding about the key of a section that is indented below the section `around`."""
    span, name = key.span, key.text
    message = f"'{name}' is a section of the file; here it belongs to '{around}'"
    columns = "1 column" if span.column == 2 else f"{span.column - 1} columns"
    help_text = f"move it, with all below it, {columns} to the left" if span.column > 1 else ""
    return UNKNOWN_KEY.at(span, message, help=help_text)
