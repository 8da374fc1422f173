"""Which key of a mapping says what the node is: the one kind or skill in it; all others must belong to it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from functools import cache

from rbxcompose.findings import Edit, Fix, nearest, replacement
from rbxcompose.manifest.tree import Mapping, Scalar
from rbxcompose.missions import codes
from rbxcompose.missions.modifiers.registry import modifier_keys
from rbxcompose.missions.other_words import SETTINGS
from rbxcompose.missions.registry import Kind, kinds
from rbxcompose.missions.strays import is_setting, tight_dashes, unknown_setting
from rbxcompose.missions.value_reader import Nodes

DASH = "- "
TIGHT_COLON = re.compile(r"[a-z][a-z0-9_]*:[^\s:/].*")


@cache
def anywhere() -> tuple[str, ...]:
    """Return the keys that any node may have."""
    return ("name", *modifier_keys())


def find_key(mapping: Mapping, nodes: Nodes, skills: Collection[str] = ()) -> tuple[str, Kind | None]:
    """Return the key of a node and its kind; None for a skill, an empty key if there is neither.

    `skills` are those of the robot, as far as they are known.
    """
    if tight := tight_dashes(mapping):
        for finding in tight:
            nodes.add(finding)
        return "", None
    own = [key for key in mapping.entries if key not in anywhere()]
    known = [key for key in own if key in kinds() and not _is_condition(mapping, key, own)]
    if known:
        return _of_kind(mapping, known[0], kinds()[known[0]], nodes, skills)
    options = {option for kind in kinds().values() for option in kind.options}
    others = [key for key in own if key not in options]
    if len(others) < len(own) and (misspelt := next((key for key in others if _near(key, kinds())), None)):
        kind = kinds()[_near(misspelt, kinds())]
        span = mapping.entries[misspelt].key.span
        nodes.add(codes.UNKNOWN_KEY.misspelt(span, f"unknown step '{misspelt}'", misspelt, kinds()))
        return _of_kind(mapping, misspelt, kind, nodes, skills)
    return _of_skill(mapping, own, others, nodes, skills)


def _is_condition(mapping: Mapping, key: str, own: list[str]) -> bool:
    """Tell whether `if` stands below another step, as a condition of it."""
    return key == "if" and "then" not in mapping and own[0] != key


def _of_kind(mapping: Mapping, key: str, kind: Kind, nodes: Nodes, skills: Collection[str]) -> tuple[str, Kind]:
    steps = []
    for other, entry in mapping.entries.items():
        if other in anywhere() or other in kind.options:
            continue
        settings = (*kind.options, *anywhere())
        if other != key and _is_stray(mapping, other, settings, skills):
            nodes.add(unknown_setting(mapping, other, f"'{kind.name}'", settings))
        elif other not in kinds() and _is_option(other):
            message, taken = f"unknown key '{other}' beside '{kind.name}'", mapping.entries
            nodes.add(codes.UNKNOWN_KEY.misspelt(entry.key.span, message, other, settings, "its settings", taken=taken))
        else:
            steps.append(other)
    _check_steps(mapping, steps, nodes, skills)
    return key, kind


def _is_stray(mapping: Mapping, key: str, settings: Collection[str], skills: Collection[str]) -> bool:
    """Tell whether a key beside a step is a setting that there is not, rather than a second step."""
    if key in skills or (key in kinds() and key not in SETTINGS):
        return False
    return key in SETTINGS or bool(_near(key, settings)) or is_setting(mapping.entries[key].value)


def _of_skill(
    mapping: Mapping, own: list[str], others: list[str], nodes: Nodes, skills: Collection[str]
) -> tuple[str, None]:
    strays = [key for key in others if _is_stray(mapping, key, anywhere(), skills)] if len(others) > 1 else []
    steps = [key for key in others if key not in strays] or strays[:1]
    for key in strays:
        if key not in steps:
            nodes.add(unknown_setting(mapping, key, "a skill", anywhere()))
    for key in own:
        if key not in others:
            help_text = f"it belongs to {_owners(key)}"
            message = f"unknown key '{key}' beside a skill"
            nodes.add(codes.UNKNOWN_KEY.at(mapping.entries[key].key.span, message, help=help_text))
    if not steps:
        if len(own) == len(others):
            nodes.add(codes.WRONG_SHAPE.at(mapping.span, "there is no step here", help=_KINDS_HELP))
        return "", None
    _check_steps(mapping, steps, nodes, skills)
    return (steps[0], None) if _is_word(mapping.entries[steps[0]].key, nodes) else ("", None)


def _check_steps(mapping: Mapping, steps: list[str], nodes: Nodes, skills: Collection[str]) -> None:
    """Only the first one belongs here; each of the others should have a dash of its own."""
    for second in steps[1:]:
        _two_steps(mapping, steps[0], second, nodes, is_known=second in kinds() or second in skills)


def _two_steps(mapping: Mapping, first: str, second: str, nodes: Nodes, *, is_known: bool) -> None:
    span = mapping.entries[second].key.span
    message, help_text = (
        f"'{second}' is a second step beside '{first}', without a dash of its own",
        f"write '- {second}: ...' as its own step",
    )
    fix = _dash_before(mapping, second) if is_known else None
    nodes.add(codes.TWO_STEPS.at(span, message, label="put a dash here", help=help_text, fix=fix))


def _dash_before(mapping: Mapping, key: str) -> Fix | None:
    """Return the fix that makes a key of a list's item the next item, if nothing behind it may belong to either."""
    keys = list(mapping.entries)
    first, second = (mapping.entries[name].key.span for name in (keys[0], key))
    behind = keys[keys.index(key) + 1 :]
    if first.column != second.column or second.line == first.line or any(_belongs(name) for name in behind):
        return None
    guard, dash = (
        span._replace(column=span.column - 2, end_line=span.line, end_column=span.column) for span in (first, second)
    )
    return Fix((Edit(guard, DASH, DASH), Edit(dash, " " * len(DASH), DASH)), True, f"'{key}' -> '- {key}'")


def _belongs(key: str) -> bool:
    return key in anywhere() or _is_option(key)


def _is_word(key: Scalar, nodes: Nodes) -> bool:
    """Tell whether a key may be the name of a skill; if not, say how it may have come about."""
    words = key.text.split()
    if TIGHT_COLON.fullmatch(key.text):
        name, _, value = key.text.partition(":")
        fix = replacement(key.span, key.text, f"{name}: {value}")
        nodes.add(
            codes.WRONG_SHAPE.at(
                key.span, "a space is missing behind the colon", help=f"write '{name}: {value}'", fix=fix
            )
        )
        return False
    if len(words) == 1:
        return True
    if not words:
        nodes.add(codes.MISSING.at(key.span, "a step is missing here"))
    elif key.span.line != key.span.end_line:
        message = "with settings below it, a step needs a colon"
        nodes.add(codes.WRONG_SHAPE.at(key.span, message, help=f"write '{words[0]}:'"))
    else:
        message = f"'{key.text}' is no step and no skill"
        nodes.add(codes.WRONG_SHAPE.at(key.span, message, help=f"write '{words[0]}: {' '.join(words[1:])}'"))
    return False


def _near(name: str, valid: Iterable[str]) -> str:
    return next(iter(nearest(name, valid)), "")


def _is_option(key: str) -> bool:
    return any(key in kind.options for kind in kinds().values())


def _owners(option: str) -> str:
    return " and ".join(f"'{name}'" for name, kind in sorted(kinds().items()) if option in kind.options)


_KINDS_HELP = "a step is a word such as 'sequence' or 'wait', or the name of a skill"
