"""The section `diagnostics`: groups of component statuses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from rbxcompose.base.config import ANALYZER
from rbxcompose.domains.diagnostics.settings import AnalyzerModel, DiagnosticsModel
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import AlwaysRun, Contents, Reading, Renames
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.manifest.validate import validate

_CONDITIONS = ("match", "expected", "name", "any", "all", "not")  # keys of analyzers and matchers that name components


def _rename(renames: Renames, name: str, node: TreeNode) -> TreeNode:
    """Return an analyzer whose patterns match the outside names of the part's components and muxes."""
    if not isinstance(node, MappingNode):
        return node
    changed = {key: Entry(entry.key, _below(renames, key, entry.value)) for key, entry in node.entries.items()}
    return replace(node, entries=changed)


def _below(renames: Renames, key: str, node: TreeNode) -> TreeNode:
    """Return what an analyzer or a matcher has below one of its keys."""
    if key in _CONDITIONS:
        return _patterns(renames, node)
    if key == "analyzers" and isinstance(node, MappingNode):
        groups = {name: Entry(entry.key, _rename(renames, name, entry.value)) for name, entry in node.entries.items()}
        return replace(node, entries=groups)
    return node


def _patterns(renames: Renames, node: TreeNode) -> TreeNode:
    """Return a list of names and patterns; a pattern that also matches muxes of the part is followed by their names."""
    match node:
        case MappingNode():
            return _rename(renames, "", node)
        case ScalarNode():
            return _changed(renames, node)[0]
        case SequenceNode(items=items):
            changed = (
                _changed(renames, item) if isinstance(item, ScalarNode) else [_patterns(renames, item)]
                for item in items
            )
            return replace(node, items=tuple(scalar_node for several in changed for scalar_node in several))


def _changed(renames: Renames, item: ScalarNode) -> list[ScalarNode]:
    texts = [] if "${" in item.text else _pattern(renames, item.text)
    return [replace(item, text=text) for text in texts] or [item]


def _pattern(renames: Renames, pattern: str) -> list[str]:
    """Return the patterns that replace one of a part: one with the prefix, and the names that have no prefix."""
    matched = {name: renames.component(name) for name in sorted(renames.running) if fnmatchcase(name, pattern)}
    others = [changed for name, changed in matched.items() if changed != f"{renames.prefix}{name}"]
    return others if len(others) == len(matched) else [f"{renames.prefix}{pattern}", *others]


def _settings(contents: Contents, names: Sequence[str]) -> dict[str, object]:
    """Return the configuration of the aggregator, which expects a status of all that runs."""
    groups = contents.of(diagnostics)
    return {**{name: getattr(groups, name) for name in groups.model_fields_set}, "expected": names}


def _levels(contents: Contents) -> dict[str, str]:
    return contents.of(diagnostics).headers


@section(
    "diagnostics",
    DiagnosticsModel,
    order=60,
    names=ANALYZER,
    at=("analyzers",),
    shared=((), ("analyzers",)),
    rename=_rename,
    always=AlwaysRun("diagnostics", _settings),
    levels=_levels,
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
    whole = validate(DiagnosticsModel, replace(node, entries=others), ("diagnostics",), reading.report)
    found = ((name, reading.valid(AnalyzerModel, name, entry.value)) for name, entry in reading.named())
    analyzers = {name: read for name, read in found if read is not None}
    return (whole or DiagnosticsModel()).model_copy(update={"analyzers": analyzers})
