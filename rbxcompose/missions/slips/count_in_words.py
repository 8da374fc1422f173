"""A number in words, a number followed by a word, and another word for `forever`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from rbxcompose.findings import replacement
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

ENDLESS: Mapping[str, str] = {
    **dict.fromkeys(("always", "endless", "endlessly", "infinite", "unlimited", "inf", "true"), "forever"),
    "-1": "forever",
}
_NUMBERS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
NUMBERS: Mapping[str, str] = {
    **{word: str(number) for number, word in enumerate(_NUMBERS, start=1)},
    "once": "1",
    "twice": "2",
}
_TIMES = re.compile(r"(?P<digits>\d+)\s*(times?|x|rounds?|attempts?|tries)")


@slip(Takes.COUNT)
def count_in_words(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words for a number, and words for no end where `forever` is allowed."""
    if not isinstance(node, ScalarNode) or node.text in place.choices:
        return None
    key, forever = place.key.text, ENDLESS.get(node.text, "")
    if forever in place.choices:
        meant, told = forever, codes.NOT_A_CHOICE.at(node.span, f"'{key}' cannot be '{node.text}'")
    elif meant := _digits(node):
        told = codes.WRONG_TYPE.at(node.span, f"'{key}' takes only a number in digits")
    else:
        return None
    fix = replacement(node.span, node.text, meant)
    return Repair(replace(node, text=meant), (replace(told, help=f"write '{meant}'", fix=fix),))


def _digits(node: ScalarNode) -> str:
    text = node.text.lower() if node.plain else ""
    found = _TIMES.fullmatch(text)
    return found["digits"] if found else NUMBERS.get(text, "")
