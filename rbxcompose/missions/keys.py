"""Which key of a mapping says what the node is: the one kind or skill in it; all others must belong to it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from rbxcompose.findings import Edit, Fix, nearest
from rbxcompose.manifest.tree import Mapping, Scalar
from rbxcompose.missions import codes
from rbxcompose.missions.modifiers import MODIFIERS
from rbxcompose.missions.node_reader import Nodes
from rbxcompose.missions.registry import Kind, kinds

ANYWHERE = ("name", *MODIFIERS)
DASH = "- "


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
        nodes.add(codes.UNKNOWN_KEY.misspelt(span, f"unknown kind '{misspelt}'", misspelt, kinds()))
        return _of_kind(mapping, misspelt, kind, nodes)
    return _of_skill(mapping, own, others, nodes)


def _of_kind(mapping: Mapping, key: str, kind: Kind, nodes: Nodes) -> tuple[str, Kind]:
    steps = []
    for other, entry in mapping.entries.items():
        if other in ANYWHERE or other in kind.options:
            continue
        if other in kinds():
            steps.append(other)
        elif _near(other, (*kind.options, *ANYWHERE)) or _is_option(other):
            message = f"unknown key '{other}' beside '{kind.name}'"
            settings, taken = (*kind.options, *ANYWHERE), mapping.entries
            nodes.add(codes.UNKNOWN_KEY.misspelt(entry.key.span, message, other, settings, "its settings", taken=taken))
        else:
            steps.append(other)
    _check_steps(mapping, steps, nodes)
    return key, kind


def _of_skill(mapping: Mapping, own: list[str], others: list[str], nodes: Nodes) -> tuple[str, None]:
    misspelt = [key for key in others if _near(key, ANYWHERE)] if len(others) > 1 else []
    skills = [key for key in others if key not in misspelt]
    for key in misspelt:
        span = mapping.entries[key].key.span
        message, taken = f"unknown key '{key}' beside a skill", mapping.entries
        nodes.add(codes.UNKNOWN_KEY.misspelt(span, message, key, ANYWHERE, taken=taken))
    for key in own:
        if key not in others:
            help_text = f"it belongs to {_owners(key)}"
            message = f"unknown key '{key}' beside a skill"
            nodes.add(codes.UNKNOWN_KEY.at(mapping.entries[key].key.span, message, help=help_text))
    if not skills:
        if not misspelt and len(own) == len(others):
            nodes.add(codes.WRONG_SHAPE.at(mapping.span, "a node needs a kind or a skill", help=_KINDS_HELP))
        return "", None
    _check_steps(mapping, skills, nodes)
    return (skills[0], None) if _is_word(mapping.entries[skills[0]].key, nodes) else ("", None)


def _check_steps(mapping: Mapping, steps: list[str], nodes: Nodes) -> None:
    """Only the first one belongs here; each of the others should have a dash of its own."""
    for second in steps[1:]:
        _two_steps(mapping, steps[0], second, nodes)


def _two_steps(mapping: Mapping, first: str, second: str, nodes: Nodes) -> None:
    span = mapping.entries[second].key.span
    message, help_text = (
        f"'{second}' is a second step in the mapping of '{first}'",
        f"write '- {second}: ...' as its own step",
    )
    fix = _dash_before(mapping, second)
    nodes.add(codes.TWO_STEPS.at(span, message, label="put a dash here", help=help_text, fix=fix))


def _dash_before(mapping: Mapping, key: str) -> Fix | None:
    """Return the fix that makes a key of a list's item the next item, if nothing behind it may belong to either."""
    keys = list(mapping.entries)
    first, second = (mapping.entries[name].key.span for name in (keys[0], key))
    behind = keys[keys.index(key) + 1 :]
    if first.column != second.column or second.line == first.line or any(_belongs(name) for name in behind):
        return None
    guard, dash = (
        replace(span, column=span.column - 2, end_line=span.line, end_column=span.column) for span in (first, second)
    )
    return Fix((Edit(guard, DASH, DASH), Edit(dash, " " * len(DASH), DASH)), True, f"'{key}' -> '- {key}'")


def _belongs(key: str) -> bool:
    return key in ANYWHERE or _is_option(key)


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
    return next(iter(nearest(name, valid)), "")


def _is_option(key: str) -> bool:
    return any(key in kind.options for kind in kinds().values())


def _owners(option: str) -> str:
    return " and ".join(f"'{name}'" for name, kind in sorted(kinds().items()) if option in kind.options)


_KINDS_HELP = "such as 'sequence', 'wait', or the name of a skill"
