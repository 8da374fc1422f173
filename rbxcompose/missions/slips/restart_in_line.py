"""`restart` with its name in the line of `afterwards`."""

from __future__ import annotations

import re

from rbxcompose.findings import Edit, Fix
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.missions.program.program import RESTART
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

_IN_LINE = re.compile(rf"{RESTART}:?\s+(?P<name>[a-z][a-z0-9_]*)")
_DEEPER = "  "


@slip(Takes.AFTERWARDS)
def restart_in_line(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise `restart NAME` and `restart: NAME`."""
    found = _IN_LINE.fullmatch(node.text) if isinstance(node, ScalarNode) and node.plain else None
    if not found or not isinstance(node, ScalarNode):
        return None
    meant = f"{RESTART}: {found['name']}"
    message = f"'{RESTART}' and what it restarts need a line of their own"
    help_text = f"write '{meant}' on the line below '{place.key.text}:', further right"
    fix = _on_a_line_below(place.key, node, meant)
    key = ScalarNode(RESTART, inner_span(node, 0, len(RESTART)))
    name = ScalarNode(found["name"], inner_span(node, found.start("name"), len(node.text)))
    finding = codes.WRONG_SHAPE.at(node.span, message, help=help_text, fix=fix)
    return Repair(MappingNode({RESTART: Entry(key, name)}, node.span), (finding,))


def _on_a_line_below(key: ScalarNode, value: ScalarNode, meant: str) -> Fix:
    """Return the fix, which applies only to a key that begins its line: inside `{}`, lines mean nothing."""
    span, indent = key.span, " " * (key.span.column - 1)
    before = span._replace(column=1, end_line=span.line, end_column=span.column)
    place = value.span._replace(line=span.line, column=span.column)
    edit = Edit(place, f"{key.text}: {value.text}", f"{key.text}:\n{indent}{_DEEPER}{meant}")
    return Fix((Edit(before, indent, indent), edit), True, f"'{value.text}' -> '{meant}'")
