"""Sections of the file that are indented below another one."""

from __future__ import annotations

from collections.abc import Collection

from rbxcompose.findings import Finding, nearest
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode
from rbxcompose.manifest.validate import UNKNOWN_KEY


def is_misplaced(entry: Entry, sections: Collection[str], keys: Collection[str]) -> bool:
    """Return whether an entry is a section of the file: it has the name of one, and none of the `keys` of an entry."""
    value = entry.value
    return (
        entry.key.text in sections
        and isinstance(value, MappingNode)
        and bool(value.entries)
        and not any(nearest(name, keys) for name in value.entries)
    )


def misplaced(key: ScalarNode, around: str) -> Finding:
    """Return the finding about the key of a section that is indented below the section `around`."""
    span, name = key.span, key.text
    message = f"'{name}' is a section of the file; here it belongs to '{around}'"
    columns = "1 column" if span.column == 2 else f"{span.column - 1} columns"
    help_text = f"move it, with all below it, {columns} to the left" if span.column > 1 else ""
    return UNKNOWN_KEY.at(span, message, help=help_text)
