"""The line with which every manifest begins."""

from __future__ import annotations

from rbxcompose.findings import Fix, replacement
from rbxcompose.manifest.tree import Mapping, Node

KEY, LINE = "rbx", "rbx: 1"


def first_line(root: Node) -> tuple[str, Fix | None]:
    """Return the help for a file without that line, and the fix if its first key is known and begins its line."""
    help_text = f"write '{LINE}' in the first line: the version of the language"
    keys = [entry.key for entry in root.entries.values()] if isinstance(root, Mapping) else []
    first = next((key for key in keys if key.span[:3] == root.span[:3]), None)
    if first is None or not first.plain or first.span.column != 1:
        return help_text, None
    fix = replacement(first.span, first.text, f"{LINE}\n{first.text}")
    return help_text, Fix(fix.edits, fix.is_safe, f"'{LINE}' before '{first.text}'")
