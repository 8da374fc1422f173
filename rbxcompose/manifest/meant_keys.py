"""Misspelt keys at the top of a file, or those of other tools: what stands below one is read as it was meant."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from rbxcompose.findings import surely_meant
from rbxcompose.manifest.foreign_words import FOREIGN
from rbxcompose.manifest.tree import MappingNode


def meant_keys(root: MappingNode, keys: Collection[str]) -> dict[str, str]:
    """Return the misspelt keys of a map, each with the one of `keys` that it was surely meant to be."""
    found: dict[str, str] = {}
    for name in root.entries.keys() - {*keys}:
        meant = FOREIGN[name] if FOREIGN.get(name) in keys else surely_meant(name, keys)
        if meant is not None and meant not in root and meant not in found.values():
            found[name] = meant
    return found


def with_keys(root: MappingNode, meant: Mapping[str, str]) -> MappingNode:
    """Return a map whose misspelt keys are those that were meant."""
    if not meant:
        return root
    return replace(root, entries={meant.get(name, name): entry for name, entry in root.entries.items()})
