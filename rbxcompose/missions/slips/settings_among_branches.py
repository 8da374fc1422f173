"""Settings of a `parallel` among its branches."""

from __future__ import annotations

from rbxcompose.findings import Edit, Finding, Fix
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.unknown_settings import is_setting, unknown_settings
from rbxcompose.slips import Repair


@slip(Takes.STEP, after=(unknown_settings,))
def settings_among_branches(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise branches that are named like settings and look like them."""
    kind = place.words.kind_of(node) if isinstance(node, MappingNode) else ""
    if not kind or not isinstance(node, MappingNode):
        return None
    slots, own = place.words.kinds[kind], node.entries[kind]
    if slots[kind].takes is not Takes.BRANCHES or not isinstance(own.value, MappingNode):
        return None
    branches = own.value
    found = {
        key: entry
        for key, entry in branches.entries.items()
        if (key in slots and key != kind and isinstance(entry.value, ScalarNode))
        or (key in place.words.modifiers and key != "name" and is_setting(entry.value))
    }
    if not found:
        return None
    last = next(reversed(branches.entries))
    findings = tuple(_among(own.key, entry, is_last=key == last) for key, entry in found.items())
    left = {key: entry for key, entry in branches.entries.items() if key not in found}
    right = Entry(own.key, MappingNode(left, branches.span))
    return Repair(MappingNode({**found, **node.entries, kind: right}, node.span), findings)


def _among(parallel: ScalarNode, setting: Entry, *, is_last: bool) -> Finding:
    message = f"'{setting.key.text}' is among the branches"
    help_text = f"move it left, into the column of '{parallel.text}'"
    fix = _moved_left(setting, parallel) if is_last else None
    return codes.WRONG_SHAPE.at(setting.key.span, message, help=help_text, fix=fix)


def _moved_left(entry: Entry, parallel: ScalarNode) -> Fix | None:
    """Return the fix that moves a key on a line of its own into the column of `parallel`."""
    span, column = entry.key.span, parallel.span.column
    if entry.value.span.end_line != span.line or column >= span.column:
        return None
    before = span._replace(column=1, end_line=span.line, end_column=span.column)
    edit = Edit(before, " " * (span.column - 1), " " * (column - 1))
    return Fix((edit,), True, f"'{entry.key.text}' into the column of '{parallel.text}'")
