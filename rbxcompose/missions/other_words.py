"""What people write who know another language, and our word for it."""

from __future__ import annotations

import re
from collections.abc import Mapping

from rbxcompose.findings import Finding, replacement
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions import codes

SETTINGS: Mapping[str, str] = {
    "delay": "wait",
    "if": "only_if",
    "limit": "timeout",
    "max_time": "timeout",
    "otherwise": "else",
    "retries": "attempts",
    "retry": "attempts",
    "sleep": "wait",
    "tries": "attempts",
    "unless": "skip_if",
    "when": "only_if",
    "while": "as_long_as",
}
"""Beside a step: a setting of ours, or a step of its own."""

FLAGS: Mapping[str, str] = {"no": "false", "off": "false", "on": "true", "yes": "true"}
ENDLESS: Mapping[str, str] = dict.fromkeys(("always", "endless", "endlessly", "infinite", "unlimited"), "forever")

_NUMBERS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
NUMBERS: Mapping[str, str] = {
    **{word: str(number) for number, word in enumerate(_NUMBERS, start=1)},
    "once": "1",
    "twice": "2",
}


_TIMES = re.compile(r"(?P<digits>\d+)\s*(times?|x|rounds?|attempts?|tries)")


def digits_of(scalar: Scalar) -> str:
    """Return the digits that were meant by a number in words, or by one with a word behind it; else nothing."""
    text = scalar.text.lower() if scalar.plain else ""
    found = _TIMES.fullmatch(text)
    return found["digits"] if found else NUMBERS.get(text, "")


def in_digits(scalar: Scalar, key: str, digits: str) -> Finding:
    """Return the finding about a number that is no digits alone."""
    fix = replacement(scalar.span, scalar.text, digits)
    return codes.WRONG_TYPE.at(
        scalar.span, f"'{key}' takes a number in digits and nothing else", help=f"write '{digits}'", fix=fix
    )


def not_our_word(scalar: Scalar, message: str, ours: Mapping[str, str]) -> Finding:
    """Return the finding about a word that cannot stand here, cured if it is one of those that have ours."""
    meant = ours.get(scalar.text.lower(), "")
    if not meant:
        return codes.NOT_A_CHOICE.at(scalar.span, message)
    fix = replacement(scalar.span, scalar.text, meant)
    return codes.NOT_A_CHOICE.at(scalar.span, message, help=f"write '{meant}'", fix=fix)
