"""Dashes without a space after them: `-go_to: dock`."""

from __future__ import annotations

import re

from rbxcompose.findings import Edit, Fix
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, without_word
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

_TIGHT = re.compile(r"-(?=[a-z][a-z0-9_]*$)")
_INDENT = "  "


@slip(Takes.STEP)
def tight_dashes(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise keys that begin with a dash."""
    entries = node.entries if isinstance(node, MappingNode) else {}
    tight = [entry.key for key, entry in entries.items() if _TIGHT.match(key)]
    if not tight or not isinstance(node, MappingNode):
        return None
    is_list = len(tight) == len(entries)  # else there is something that is no item of a list
    message = "a space is missing after this dash"
    findings = (
        codes.WRONG_SHAPE.at(key.span, message, help=f"write '- {key.text[1:]}'", fix=_spaced(key) if is_list else None)
        for key in tight
    )
    return Repair(without_word(node, place.words), tuple(findings))


def _spaced(key: ScalarNode) -> Fix:
    """Return the fix that puts a space after a dash; it applies only to a line of its own."""
    span = key.span
    before = span._replace(column=span.column - len(_INDENT), end_line=span.line, end_column=span.column)
    meant = f"- {key.text[1:]}"
    return Fix((Edit(before, _INDENT, _INDENT), Edit(span, key.text, meant)), True, f"'{key.text}' -> '{meant}'")
