"""Regular expressions for names of statuses. Names come from anybody, so that none may take long on any name.

Python's engine goes back and tries again, which takes exponential time where a repeat is repeated. What is left here is
at most cubic in the length of a name, which is bounded.
"""

from __future__ import annotations

import re

LONGEST = 300  # characters of an expression
MOST_REPEATS = 3
_COUNTED = re.compile(r"\{\d*+(?:,\d*+)?+\}")
_CLASS = re.compile(r"\[\^?+\]?+(?:\\.|[^\]\\])*+\]")


def fits_regex(text: str, name: str) -> bool:
    """Return whether an expression without trouble fits a whole name."""
    return re.compile(text).fullmatch(name) is not None  # `re` remembers what it has compiled


def trouble_of(text: str) -> str:
    """Return why an expression is not taken; empty if it is."""
    if len(text) > LONGEST:
        return f"it has more than {LONGEST} characters"
    try:
        re.compile(text)
    except (re.error, RecursionError, OverflowError) as error:
        return str(error)
    return _slow(text)


def _slow(text: str) -> str:
    """Return what could take long in a sound expression."""
    has_choice = [False]  # of each open group: whether it holds a repeat or a choice
    is_repeatable, repeats, place = True, 0, 0
    while place < len(text):
        size, last_group = 1, False
        match text[place]:
            case "\\":
                if text[place + 1].isdigit():
                    return "it refers back to a group"
                size = 2
            case "[":
                found = _CLASS.match(text, place)
                size = len(found.group()) if found else 1
            case "(":
                if text.startswith("(?", place) and not text.startswith("(?:", place):
                    return "of groups with '(?', only '(?:...)' is taken"
                has_choice.append(False)
                size = 3 if text.startswith("(?:", place) else 1
            case ")":
                last_group = has_choice.pop()
                has_choice[-1] = has_choice[-1] or last_group
            case "|":
                has_choice[-1] = True
            case "*" | "+" | "{":
                counted = _COUNTED.match(text, place)
                if text[place] != "{" or counted:
                    if not is_repeatable:
                        return "it repeats a group that holds a repeat or a choice itself, which could take for ever"
                    repeats += 1
                    has_choice[-1] = True
                    size = len(counted.group()) if counted else 1
        is_repeatable, place = not last_group, place + size
    return f"it has more than {MOST_REPEATS} repeats, which could take long" if repeats > MOST_REPEATS else ""
