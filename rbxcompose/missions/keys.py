"""Which key of a mapping says what the node is: the one kind or skill in it; all others must belong to it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from rbxcompose.findings import SIMILAR, suggest
from rbxcompose.manifest.tree import Mapping, Scalar
from rbxcompose.missions import codes
from rbxcompose.missions.modifiers import MODIFIERS
from rbxcompose.missions.node_reader import Nodes
from rbxcompose.missions.registry import Kind, kinds

ANYWHERE = ("name", *MODIFIERS)


def find_key(mapping: Mapping, nodes: Nodes) -> tuple[str, Kind | None]:
    """Return the key of a node and its kind; None for a skill, an empty key if there is neither."""
    own = [key for key in mapping.entries if key not in ANYWHERE]
    known = [key for key in own if key in kinds()]
    if known:
        return _of_kind(mapping, known[0], kinds()[known[0]], nodes)
    options = {option for kind in kinds().values() for option in kind.options}
    others = [key for key in own if key not in options]
    if len(others) < len(own) and (misspelt := next((key for key in others if _near(key, kinds())), None)):
        kind = kinds()[_near(misspelt, kinds())]
        span = mapping.entries[misspelt].key.span
        nodes.add(codes.UNKNOWN_KEY.at(span, f"unknown kind '{misspelt}'", help=f"did you mean '{kind.name}'?"))
        return _of_kind(mapping, misspelt, kind, nodes)
    return _of_skill(mapping, own, others, nodes)


def _of_kind(mapping: Mapping, key: str, kind: Kind, nodes: Nodes) -> tuple[str, Kind]:
    for other, entry in mapping.entries.items():
        if other == key or other in ANYWHERE or other in kind.options:
            continue
        if other in kinds():
            _two_steps(mapping, key, other, nodes)
        elif _near(other, (*kind.options, *ANYWHERE)) or _is_option(other):
            message = f"unknown key '{other}' beside '{kind.name}'"
            help_text = suggest(other, (*kind.options, *ANYWHERE), "its settings")
            nodes.add(codes.UNKNOWN_KEY.at(entry.key.span, message, help=help_text))
        else:
            _two_steps(mapping, key, other, nodes)
    return key, kind


def _of_skill(mapping: Mapping, own: list[str], others: list[str], nodes: Nodes) -> tuple[str, None]:
    misspelt = [key for key in others if _near(key, ANYWHERE)] if len(others) > 1 else []
    skills = [key for key in others if key not in misspelt]
    for key in misspelt:
        span = mapping.entries[key].key.span
        nodes.add(codes.UNKNOWN_KEY.at(span, f"unknown key '{key}' beside a skill", help=suggest(key, ANYWHERE)))
    for key in own:
        if key not in others:
            help_text = f"it belongs to {_owners(key)}"
            message = f"unknown key '{key}' beside a skill"
            nodes.add(codes.UNKNOWN_KEY.at(mapping.entries[key].key.span, message, help=help_text))
    if not skills:
        if not misspelt and len(own) == len(others):
            nodes.add(codes.WRONG_SHAPE.at(mapping.span, "a node needs a kind or a skill", help=_KINDS_HELP))
        return "", None
    for other in skills[1:]:
        _two_steps(mapping, skills[0], other, nodes)
    return (skills[0], None) if _is_word(mapping.entries[skills[0]].key, nodes) else ("", None)


def _two_steps(mapping: Mapping, first: str, second: str, nodes: Nodes) -> None:
    span = mapping.entries[second].key.span
    message = f"'{second}' is a second step in the mapping of '{first}'"
    nodes.add(
        codes.TWO_STEPS.at(span, message, label="put a dash here", help=f"write '- {second}: ...' as its own step")
    )


def _is_word(key: Scalar, nodes: Nodes) -> bool:
    """Tell whether a key may be the name of a skill; if not, say how it may have come about."""
    words = key.text.split()
    if len(words) == 1:
        return True
    if not words:
        nodes.add(codes.MISSING.at(key.span, "a step is missing here"))
    elif key.span.line != key.span.end_line:
        message = "with settings below it, a step needs a colon"
        nodes.add(codes.WRONG_SHAPE.at(key.span, message, help=f"write '{words[0]}:'"))
    else:
        message = f"'{key.text}' is no name of a kind or a skill"
        nodes.add(codes.WRONG_SHAPE.at(key.span, message, help=f"write '{words[0]}: {' '.join(words[1:])}'"))
    return False


def _near(name: str, valid: Iterable[str]) -> str:
    return next(iter(difflib.get_close_matches(name, sorted(valid), n=1, cutoff=SIMILAR)), "")


def _is_option(key: str) -> bool:
    return any(key in kind.options for kind in kinds().values())


def _owners(option: str) -> str:
    return " and ".join(f"'{name}'" for name, kind in sorted(kinds().items()) if option in kind.options)


_KINDS_HELP = "such as 'sequence', 'wait', or the name of a skill"
