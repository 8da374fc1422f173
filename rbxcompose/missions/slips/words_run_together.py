"""A skill and its value without the colon or space between them: `go_to:dock`, `say hello`, no colon above settings."""

from __future__ import annotations

import re

from rbxcompose.findings import Finding, replacement
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, without_word
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.unknown_settings import unknown_settings
from rbxcompose.slips import Repair

_TIGHT_COLON = re.compile(r"[a-z][a-z0-9_]*:[^\s:/].*")


@slip(Takes.STEP, after=(unknown_settings,))
def words_run_together(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a step whose word is several words."""
    own = place.words.own(node) if isinstance(node, MappingNode) else []
    if not own or not isinstance(node, MappingNode):
        return None
    finding = _told(node.entries[place.words.kind_of(node) or own[0]].key)
    return Repair(without_word(node, place.words), (finding,)) if finding else None


def _told(key: ScalarNode) -> Finding | None:
    words = key.text.split()
    if _TIGHT_COLON.fullmatch(key.text):
        name, _, value = key.text.partition(":")
        meant, message = f"{name}: {value}", "a space is missing after the colon"
        fix = replacement(key.span, key.text, meant)
        return codes.WRONG_SHAPE.at(key.span, message, help=f"write '{meant}'", fix=fix)
    if len(words) < 2:
        return None
    if key.span.line != key.span.end_line:
        message = "a step with settings below it needs a colon"
        return codes.WRONG_SHAPE.at(key.span, message, help=f"write '{words[0]}:'")
    message, meant = f"'{key.text}' is neither a step nor a skill", f"{words[0]}: {' '.join(words[1:])}"
    return codes.WRONG_SHAPE.at(key.span, message, help=f"write '{meant}'")
