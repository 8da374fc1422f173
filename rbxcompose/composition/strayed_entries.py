"""Entries of a section that stand at the top of the file: `battery:` in a profile, without `components:` above it."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

from rbxcompose.findings import Report
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import ROBOT, is_empty
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import UNKNOWN_KEY


def without_strayed(root: MappingNode, keys: Container[str], report: Report) -> MappingNode:
    """Return a tree without keys that are the names of entries of its sections, after a finding for each."""
    left = dict(root.entries)
    empty = [one for one in sections(ROBOT) if one.names and (node := root.get(one.name)) and is_empty(node)]
    for name, entry in root.entries.items():
        home = None if name in keys else next((one for one in sections(ROBOT) if name in one.names_in(root)), None)
        if name not in keys and home is None and len(empty) == 1 and isinstance(entry.value, MappingNode):
            home = empty[0]
        if home and isinstance(entry.value, MappingNode):
            del left[name]
            message = f"'{name}' is {_with_article(home.entry)}, not a section of the file"
            above = ".".join((home.name, *map(str, home.at)))
            report.add(UNKNOWN_KEY.at(entry.key.span, message, help=f"write it below '{above}:', one level deeper"))
    return replace(root, entries=left)


def _with_article(word: str) -> str:
    return f"{'an' if word[:1] in 'aeiou' else 'a'} {word}"
