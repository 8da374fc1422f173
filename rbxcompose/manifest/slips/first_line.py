"""A file without the first line of every manifest."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.findings import Fix, replacement
from rbxcompose.manifest.header import KINDS
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.slips import Repair

KEY, VERSION = "rbx", "1"


@value_slip("missing")
def first_line(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it; there is a fix if it is a file of ours, and its first key is known and begins its line."""
    if place.path != (KEY,) or not isinstance(node, MappingNode):
        return None
    line = f"{KEY}: {VERSION}"
    first = next((entry.key for entry in node.entries.values() if entry.key.span[:3] == node.span[:3]), None)
    fix = None
    kind = node.get("kind")
    is_ours = isinstance(kind, ScalarNode) and kind.text in KINDS
    if is_ours and first and first.plain and first.span.column == 1:
        edits = replacement(first.span, first.text, f"{line}\n{first.text}").edits
        fix = Fix(edits, True, f"'{line}' before '{first.text}'")
    help_text = f"write '{line}' in the first line: the version of the language"
    right = Entry(ScalarNode(KEY, node.span), ScalarNode(VERSION, node.span))
    finding = replace(place.finding, help=help_text, fix=fix)
    return Repair(MappingNode({KEY: right, **node.entries}, node.span), (finding,))
