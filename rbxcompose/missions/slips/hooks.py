"""Hooks with steps, which can only act."""

from collections.abc import Mapping

from rbxcompose.base.findings import Edit, Finding, Fix, nearest
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words, placeholder
from rbxcompose.missions.program.answers import DEEDS, OPTIONS
from rbxcompose.missions.slips import slip

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
        return Repair(placeholder(node.span), (_cannot_do(place.key.text, ScalarNode(word, node.span)),))
    steps = [name for name in node.entries if is_step(name, place.words)] if isinstance(node, MappingNode) else []
    if not steps or not isinstance(node, MappingNode):
        return None
    findings = tuple(_cannot_do(place.key.text, node.entries[name].key) for name in steps)
    left = {name: entry for name, entry in node.entries.items() if not is_step(name, place.words)}
    return Repair(MappingNode(left, node.span) if left else placeholder(node.span), findings)


def is_step(word: str, words: Words) -> bool:
    """Return whether a word below a hook is a step; if the robot's skills are unknown, any unknown word may be."""
    if word in _KEYS or not word:
        return False
    return words.is_step(word) if words.skills else word in words.kinds or not nearest(word, _KEYS)


def _cannot_do(hook: str, word: ScalarNode) -> Finding:
    message = f"'{hook}' cannot do steps such as '{word.text}'"
    return codes.UNKNOWN_KEY.at(word.span, message, help=_CURES.get(hook, "{}").format(word.text))


_DASH = "- "


@slip(Takes.HOOK, before=(steps_below_a_hook,))
def dashes_below_a_hook(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a list of maps; if it contains only steps, its dashes are not the mistake."""
    hook = place.key.text
    items = node.items if isinstance(node, SequenceNode) else ()
    maps = [item for item in items if isinstance(item, MappingNode) and item.entries]
    if not maps or len(maps) < len(items):
        return None
    entries: dict[str, Entry] = {}
    edits: list[Edit] = []
    for item in maps:
        first = next(iter(item.entries.values())).key.span
        dash = first._replace(column=first.column - len(_DASH), end_line=first.line, end_column=first.column)
        edits.append(Edit(dash, _DASH, " " * len(_DASH)))
        for name, entry in item.entries.items():
            entries.setdefault(name, entry)
    meant = MappingNode(entries, node.span)
    if all(is_step(name, place.words) for name in entries):
        return Repair(meant, ())
    is_once = len(entries) == sum(len(item.entries) for item in maps)
    word = next(iter(maps[0].entries))
    what = f"the dash before '{word}'" if len(maps) == 1 else "the dashes"
    help_text = f"remove {what}" + ("" if is_once else "; each word can be used there once")
    fix = Fix(tuple(edits), True, f"'- {word}' -> '{word}'") if is_once else None
    message = f"the entries below '{hook}' have no dashes"
    return Repair(meant, (codes.WRONG_SHAPE.at(edits[0].span, message, help=help_text, fix=fix),))
