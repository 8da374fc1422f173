"""What people write below hooks that cannot stand there: lists, and steps that take time."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from rbxcompose.findings import Edit, Finding, Fix, nearest
from rbxcompose.manifest.tree import Entry, Scalar, Sequence
from rbxcompose.manifest.tree import Mapping as Tree
from rbxcompose.missions import codes
from rbxcompose.missions.moments import DEEDS, OPTIONS
from rbxcompose.missions.registry import kinds

KEYS = (*DEEDS, *OPTIONS)
_DASH = "- "
_CURES: Mapping[str, str] = {
    "on_start": "write it as a step of its own before this one",
    "on_success": "write it as a step of its own after this one",
    "on_failure": "write a 'fallback' with this step first and '{}' second",
    "on_halt": "only 'set', 'log' and 'publish' can be done when a step is stopped",
    "on_enter": "make it the first step below the state's 'do'",
    "on_exit": "make it the last step below the state's 'do'",
}


def is_step(word: str, skills: Collection[str]) -> bool:
    """Tell whether a word below a hook is a step, which a hook cannot do; without `skills`, any odd one may be."""
    if word in KEYS or not word:
        return False
    return word in kinds() or (word in skills if skills else not nearest(word, KEYS))


def step_in_hook(hook: str, word: Scalar) -> Finding:
    """Return the finding about a step below a hook, with where it belongs."""
    message = f"'{hook}' cannot do steps such as '{word.text}'"
    return codes.UNKNOWN_KEY.at(word.span, message, help=_CURES.get(hook, "{}").format(word.text))


def without_dashes(hook: str, written: Sequence) -> tuple[Tree | None, Finding | None]:
    """Return what a list below a hook was meant to be and the finding about its dashes; None if it holds no deeds."""
    items = [item for item in written.items if isinstance(item, Tree) and item.entries]
    if not items or len(items) < len(written.items):
        return None, None
    entries: dict[str, Entry] = {}
    edits: list[Edit] = []
    is_once = True
    for item in items:
        is_once = is_once and not entries.keys() & item.entries.keys()
        entries = {**item.entries, **entries}
        first = next(iter(item.entries.values())).key.span
        dash = first._replace(column=first.column - len(_DASH), end_line=first.line, end_column=first.column)
        edits.append(Edit(dash, _DASH, " " * len(_DASH)))
    word = next(iter(items[0].entries))
    what = f"the dash before '{word}'" if len(items) == 1 else "the dashes"
    help_text = f"take {what} away" + ("" if is_once else "; each word can stand there once")
    fix = Fix(tuple(edits), True, f"'- {word}' -> '{word}'") if is_once else None
    message = f"what stands below '{hook}' has no dashes"
    return Tree(entries, written.span), codes.WRONG_SHAPE.at(edits[0].span, message, help=help_text, fix=fix)
