"""`name = value` below `set`, and other ways to set a value that people know from elsewhere."""

from __future__ import annotations

import re

from rbxcompose.findings import replacement
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, told
from rbxcompose.missions.language.spans import inner_span
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

_WRITTEN = re.compile(
    r"\$?(?P<name>[a-z][a-z0-9_]*)(?P<sign>\s*(?::=|[+-]=|=(?!=))\s*|:)(?P<value>[^\s=].*)", re.DOTALL
)
_EXAMPLE = "'name: value'"


@slip(Takes.ASSIGNMENTS)
def assigned_in_line(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a text below `set`; one that is no assignment is reported, too, and gets no further findings."""
    if not isinstance(node, ScalarNode):
        return None
    key = place.key
    found = _WRITTEN.fullmatch(node.text) if node.plain else None
    if found is None:
        message = f"'{key.text}' needs names and their values"
        help_text = f"write {_EXAMPLE} on the line below '{key.text}:', further right"
        return Repair(told(node.span), (codes.WRONG_SHAPE.at(key.span, message, help=help_text),))
    name, sign, value = found["name"], found["sign"].strip(), found["value"]
    if node.span.line != node.span.end_line:
        message = f"below '{key.text}', write each name on a line of its own, followed by a colon"
        finding = codes.WRONG_SHAPE.at(node.span, message, help=f"write {_EXAMPLE}, such as '{name}: 1'")
        return Repair(told(node.span), (finding,))
    if sign in ("+=", "-="):
        value = f"${name} {sign[0]} {value}" if value.split() == [value] else f"${name} {sign[0]} ({value})"
    meant = f"{name}: {value}"
    message = "a space is missing after the colon" if sign == ":" else f"'{key.text}' takes a colon, not '{sign}'"
    is_below = node.span.line > key.span.line
    where = "" if is_below else f" on the line below '{key.text}:', further right"
    fix = replacement(node.span, node.text, meant) if is_below else None
    finding = codes.WRONG_SHAPE.at(node.span, message, help=f"write '{meant}'{where}", fix=fix)
    left = ScalarNode(name, inner_span(node, found.start("name"), found.end("name")))
    right = ScalarNode(value, inner_span(node, found.start("value"), len(node.text)))
    return Repair(MappingNode({name: Entry(left, right)}, node.span), (finding,))
