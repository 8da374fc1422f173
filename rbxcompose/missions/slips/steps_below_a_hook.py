"""Steps below a hook, which cannot do anything that takes time."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.findings import Finding, nearest
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words, told
from rbxcompose.missions.program.moments import DEEDS, OPTIONS
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

_KEYS = (*DEEDS, *OPTIONS)
_CURES: Mapping[str, str] = {
    "on_start": "write it as a step of its own before this one",
    "on_success": "write it as a step of its own after this one",
    "on_failure": "write a 'fallback' with this step first and '{}' second",
    "on_halt": "only 'set', 'log' and 'publish' can be done when a step is stopped",
    "on_enter": "make it the first step below the state's 'do'",
    "on_exit": "make it the last step below the state's 'do'",
}


@slip(Takes.HOOK)
def steps_below_a_hook(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words of steps on the line of a hook or below it; the other keys there are read."""
    if isinstance(node, ScalarNode):
        word = node.text.partition(" ")[0] if node.plain else ""
        if not is_step(word, place.words):
            return None
        return Repair(told(node.span), (_cannot_do(place.key.text, ScalarNode(word, node.span)),))
    steps = [name for name in node.entries if is_step(name, place.words)] if isinstance(node, MappingNode) else []
    if not steps or not isinstance(node, MappingNode):
        return None
    findings = tuple(_cannot_do(place.key.text, node.entries[name].key) for name in steps)
    left = {name: entry for name, entry in node.entries.items() if not is_step(name, place.words)}
    return Repair(MappingNode(left, node.span) if left else told(node.span), findings)


def is_step(word: str, words: Words) -> bool:
    """Return whether a word below a hook is a step; if the robot's skills are unknown, any unknown word may be."""
    if word in _KEYS or not word:
        return False
    return words.is_step(word) if words.skills else word in words.kinds or not nearest(word, _KEYS)


def _cannot_do(hook: str, word: ScalarNode) -> Finding:
    message = f"'{hook}' cannot do steps such as '{word.text}'"
    return codes.UNKNOWN_KEY.at(word.span, message, help=_CURES.get(hook, "{}").format(word.text))
