"""A list below a hook, which has no dashes."""

from __future__ import annotations

from rbxcompose.findings import Edit, Fix
from rbxcompose.manifest.tree import Entry, MappingNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.steps_below_a_hook import is_step, steps_below_a_hook
from rbxcompose.slips import Repair

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
