"""Foreign text made fit for a terminal or a log line: nothing in it can move the cursor, hide or reorder text."""

import re
import unicodedata

FORBIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufeff\ufffe\uffff]"
)
"""Characters that no manifest may hold: control characters but tab and newline, bidi controls, non-characters."""

_HIDDEN = re.compile(FORBIDDEN.pattern + "|[\xad\u061c\u180e\u200b-\u200f\u2060-\u206f]")
"""Also what text may hold but nobody can see: soft hyphens, joiners and spaces without width."""
_INVISIBLE = re.compile(r"[\t\n]|" + _HIDDEN.pattern)
_SHORT = {"\t": "\\t", "\n": "\\n", "\r": "\\r"}


def code_point(character: str) -> str:
    """Return the code point of a character: `U+001B`."""
    return f"U+{ord(character):04X}"


def _visible(match: re.Match[str]) -> str:
    character = match.group()
    if character in _SHORT:
        return _SHORT[character]
    return f"\\x{ord(character):02x}" if ord(character) < 0x100 else f"\\u{ord(character):04x}"


def plain(text: str, limit: int = 200) -> str:
    """Return `text` on one line with invisible characters spelt out, cut after `limit` characters with a count."""
    shown = _INVISIBLE.sub(_visible, text[:limit])
    return f"{shown}... ({len(text) - limit:,} more characters)" if len(text) > limit else shown


def escaped(json: str) -> str:
    """Return a JSON text whose strings contain nothing that can move the cursor, hide or reorder text."""
    return _HIDDEN.sub(lambda match: f"\\u{ord(match.group()):04x}", json)


def columns(text: str) -> int:
    """Return the number of terminal columns that a text takes."""
    return sum(map(_columns, text))


def fitted(text: str, width: int) -> str:
    """Return `text` cut to at most `width` terminal columns, with dots where something was cut."""
    if columns(text) <= width:
        return text
    kept, room = "", width - 3
    for character in text:
        room -= _columns(character)
        if room < 0:
            break
        kept += character
    return kept + "..."[: max(0, width)]


def _columns(character: str) -> int:
    if unicodedata.combining(character) or unicodedata.category(character) in ("Mn", "Me", "Cf"):
        return 0
    return 2 if unicodedata.east_asian_width(character) in ("W", "F") else 1
