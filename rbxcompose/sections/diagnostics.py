"""The section `diagnostics`: groups of component statuses."""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Annotated

from pydantic import Field

from rbxcompose.config import Config, Name, Time
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.renamer import Renames
from rbxcompose.manifest.section import Reading
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.manifest.validate import validate
from rbxcompose.references import ANALYZER, RUNNING, Refers

Pattern = Annotated[str, Refers(RUNNING, is_told=True)]


class AnalyzerModel(Config):
    """One group of statuses."""

    match: tuple[Pattern, ...] = Field(min_length=1)
    """Names of components, or patterns with `*`."""
    timeout: Time | None = Field(None, gt=0)
    """A status that is older is stale."""
    expected: tuple[Pattern, ...] = ()
    """Names that must report, whatever matches."""


class DiagnosticsModel(Config):
    """How the states of components are grouped."""

    analyzers: dict[Name, AnalyzerModel] = {}
    """Groups by name."""


def _rename(renames: Renames, name: str, node: TreeNode) -> TreeNode:
    """Return an analyzer whose patterns match the outside names of the part's components and muxes."""
    if not isinstance(node, MappingNode):
        return node
    changed = {
        key: Entry(one.key, _patterns(renames, one.value)) if key in ("match", "expected") else one
        for key, one in node.entries.items()
    }
    return replace(node, entries=changed)


def _patterns(renames: Renames, node: TreeNode) -> TreeNode:
    """Return a list of names and patterns; a pattern that also matches muxes of the part is followed by their names."""
    if not isinstance(node, SequenceNode):
        return node
    items: list[TreeNode] = []
    for item in node.items:
        changed = _pattern(renames, item.text) if isinstance(item, ScalarNode) and "${" not in item.text else []
        items += [replace(item, text=text) for text in changed] if isinstance(item, ScalarNode) and changed else [item]
    return replace(node, items=tuple(items))


def _pattern(renames: Renames, pattern: str) -> list[str]:
    """Return the patterns that replace one of a part: one with the prefix, and the names that have no prefix."""
    matched = {name: renames.component(name) for name in sorted(renames.running) if fnmatchcase(name, pattern)}
    others = [changed for name, changed in matched.items() if changed != f"{renames.prefix}{name}"]
    return others if len(others) == len(matched) else [f"{renames.prefix}{pattern}", *others]


@section(
    "diagnostics",
    DiagnosticsModel,
    order=60,
    names=ANALYZER,
    at=("analyzers",),
    shared=((), ("analyzers",)),
    rename=_rename,
)
def diagnostics(reading: Reading[DiagnosticsModel]) -> DiagnosticsModel:
    """How the states of components are grouped: each group is OK, WARN, ERROR or STALE.

    Example:
        diagnostics:
          analyzers:
            power:
              match: [battery, charger*]
              timeout: 5 s
              expected: [charger]
    """
    node = reading.node
    if not isinstance(node, MappingNode):
        return reading.whole() or DiagnosticsModel()
    others = {name: entry for name, entry in node.entries.items() if name != "analyzers"}
    validate(DiagnosticsModel, replace(node, entries=others), ("diagnostics",), reading.report)
    found = ((name, reading.valid(AnalyzerModel, name, entry.value)) for name, entry in reading.named())
    return DiagnosticsModel(analyzers={name: read for name, read in found if read is not None})
