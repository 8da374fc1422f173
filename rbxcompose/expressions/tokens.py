"""Text to tokens: numbers take the unit that follows them, so that `0.3 m/s` and `30 %` are one token each."""

from __future__ import annotations

import re
from collections.abc import Iterator
from enum import Enum, auto

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.tree import ExpressionError
from rbxcompose.units import NUMBER_TEXT, UNITS, Quantity, UnitError, quantity, unit_help

KEYWORDS = frozenset({"true", "false", "and", "or", "not", "in"})
NAME = r"[A-Za-z][A-Za-z0-9_]*"


class TokenKind(Enum):
    """The kinds of tokens; their names are those of the groups in `_TOKEN`."""

    NUMBER = auto()
    TEXT = auto()
    VARIABLE = auto()
    WORD = auto()
    SYMBOL = auto()  # keywords, too
    END = auto()


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of the text; `text` is as written, for a variable without its `$`; numbers have a `quantity`."""

    kind: TokenKind
    text: str
    start: int
    end: int
    quantity: Quantity | None = None


_SPACE = re.compile(r"\s*")
_TOKEN = re.compile(
    rf"""(?P<NUMBER>{NUMBER_TEXT})
    | (?P<TEXT>'[^']*'|"[^"]*")
    | \$(?P<VARIABLE>{NAME})
    | (?P<SYMBOL>(?:{"|".join(sorted(KEYWORDS))})(?![A-Za-z0-9_.])|<=|>=|==|!=|\*(?!\*)|/(?!/)|[-+<>()\[\],.])
    | (?P<WORD>{NAME}(?:\.{NAME})*)
    | (?P<END>\Z)""",
    re.VERBOSE,
)
# The longest unit wins; a letter after it makes it another word: `6 m/step` is a division by `step`.
_LONGEST_FIRST = "|".join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))
_UNIT = re.compile(rf"\s*({_LONGEST_FIRST})(?![A-Za-z0-9_])")
_IN_BRACES = re.compile(rf"\{{{{1,2}}\s*\$?({NAME})\s*\}}")  # as templates and BehaviorTree.CPP write a name
_NO_UNIT = re.compile(r"\s*(?!(?:and|or|in|not)\b)((?:[^\W\d]|°)[\w/^]*)")
# `3 in $list` is a membership test, while `3 in` is a length: only in the first does a value follow the word.
_VALUE = re.compile(r"""\s*(?!(?:and|or|in|not)\b)[$\w'"(\[]""")

CURLY_QUOTES = "\u201c\u201d\u201e\u2018\u2019\u201a\u00ab\u00bb"  # those of books, which are letters to YAML
# Symbols that other languages have and this one lacks; longer ones first.
_FOREIGN = {
    "${": "'${...}' is filled in earlier; here write '$name', which is looked up while the robot runs",
    "$": "a name follows the '$', such as '$battery'",
    "&&": "write 'and'",
    "||": "write 'or'",
    "**": "there is no power operator; multiply",
    "^": "there is no power operator; multiply",
    "//": "write round(...) for whole numbers",
    "=": "write '==' to compare",
    "!": "write 'not'",
    "%": "a percentage is written with its number, such as '30 %'; there is no remainder operator",
    ":": "a time is a number with a unit, such as '5 s' or '2 min'",
    **dict.fromkeys(CURLY_QUOTES, "quotes are straight: write \" or '"),
    "{{": "no braces are needed here: '$name' is a value of the robot or the mission, such as '$battery < 30 %'",
    "{": "a map cannot be written here",
    "_": "names start with a letter",
    "'": "the quote is not closed",
    '"': "the quote is not closed",
}


def tokens(text: str) -> Iterator[Token]:
    """Yield the tokens of a text; the last one is END.

    Raises:
        ExpressionError: when the iteration reaches text that belongs to no expression.
    """
    position = 0
    kind = None
    while kind is not TokenKind.END:
        start = _space_end(text, position)
        match = _TOKEN.match(text, start)
        if not match or not match.lastgroup:
            raise _unreadable(text, start)
        kind, position = TokenKind[match.lastgroup], match.end()
        read = None
        if kind is TokenKind.NUMBER:
            read, position = _with_unit(text, start, position)
        yield Token(kind, match[match.lastgroup], start, position, read)


def _space_end(text: str, position: int) -> int:
    space = _SPACE.match(text, position)
    return space.end() if space else position


def _with_unit(text: str, start: int, end: int) -> tuple[Quantity, int]:
    """Return the quantity whose number stands at `start` to `end`, and where its unit ends."""
    number = text[start:end]
    unit = _UNIT.match(text, end)
    if unit and unit[1] == "in" and _VALUE.match(text, unit.end()):
        unit = None
    elif not unit and (wrong := _NO_UNIT.match(text, end)):
        raise ExpressionError(f"unknown unit '{wrong[1]}'", wrong.start(1), wrong.end(1), unit_help(wrong[1], number))
    if unit:
        end = unit.end()
    try:
        return quantity(number, UNITS[unit[1]] if unit else None), end
    except UnitError as error:
        raise ExpressionError(error.message, start, end) from None


def _unreadable(text: str, start: int) -> ExpressionError:
    foreign = next((symbol for symbol in _FOREIGN if text.startswith(symbol, start)), None)
    shown = foreign or text[start]
    fix = _FOREIGN[foreign] if foreign else ""
    if braces := _IN_BRACES.match(text, start):
        fix = f"write '${braces[1]}'"
    return ExpressionError(f"{shown!r} means nothing in an expression", start, start + len(shown), fix)
