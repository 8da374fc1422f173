"""A person's answers, read and checked: names, places and sentences."""

from __future__ import annotations

import re
from collections.abc import Collection

from rbxcompose.config import Place
from rbxcompose.findings import Finding, kind
from rbxcompose.printable import FORBIDDEN, plain
from rbxcompose.units import ANGLE, LENGTH, UnitError, to_si

LONGEST_NAME = 60  # characters
LONGEST_TEXT = 200
FARTHEST = 100.0  # [m] from the origin of `map`; a person should plan a longer tour

NAME = kind("RBX9102")
ANSWER = kind("RBX9103")

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_YAML_WORDS = frozenset({"true", "false", "null"})  # as YAML values these are not texts


class AnswerError(Exception):
    """Raised with the finding on an answer that cannot be used."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


def read_name(text: str, what: str, taken: Collection[str] = ()) -> str:
    """Return a name for `what` ("the robot").

    Raises:
        AnswerError: if it is no valid name, or one of `taken`.
    """
    shown = plain(text, LONGEST_NAME)
    if not _NAME.fullmatch(text) or len(text) > LONGEST_NAME:
        raise AnswerError(NAME.at(None, f"'{shown}' cannot be the name of {what}", help=_better(text)))
    if text in _YAML_WORDS or text in taken:
        raise AnswerError(NAME.at(None, f"'{shown}' cannot be the name of {what}, it is taken", help="choose another"))
    return text


def _better(text: str) -> str:
    made = name_like(text)
    return f"did you mean '{made}'?" if made else "a name has lower-case letters, digits and underscores"


def name_like(text: str) -> str:
    """Return the name that is most like a text, empty if there is none."""
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).lstrip("_0123456789").rstrip("_")[:LONGEST_NAME]


def read_text(text: str) -> str:
    """Return a sentence.

    Raises:
        AnswerError: if it is empty, longer than a line, or has characters that no manifest may have.
    """
    text = text.strip()
    if not text or len(text) > LONGEST_TEXT or FORBIDDEN.search(text) or set(text) & {"\t", "\n"}:
        why = f"a sentence on one line is needed, of at most {LONGEST_TEXT} characters"
        raise AnswerError(ANSWER.at(None, f"'{plain(text, 40)}' cannot be used", help=why))
    return text


def read_yes(text: str) -> bool:
    """Return whether the answer is yes.

    Raises:
        AnswerError: if it is neither yes nor no.
    """
    word = text.strip().lower()
    if word and ("yes".startswith(word) or "no".startswith(word)):
        return word.startswith("y")
    raise AnswerError(ANSWER.at(None, f"'{plain(text, 40)}' is neither yes nor no"))


def read_place(text: str, taken: Collection[str] = ()) -> Place:
    """Return the place that is written as `NAME=X,Y` or `NAME=X,Y,HEADING`, such as `table=2 m,50 cm,90 deg`.

    Raises:
        AnswerError: if it has another form, if the name is one of `taken`, or if it is too far away.
    """
    name, equals, pose = text.partition("=")
    numbers = [number.strip() for number in pose.split(",")]
    if not equals or len(numbers) not in (2, 3):
        help_text = "write NAME=X,Y or NAME=X,Y,HEADING, such as 'table=2 m,50 cm,90 deg'"
        raise AnswerError(ANSWER.at(None, f"'{plain(text, 40)}' is not a place", help=help_text))
    name = read_name(name.strip(), "a place", taken)
    try:
        x, y = to_si(numbers[0], LENGTH), to_si(numbers[1], LENGTH)
        heading = to_si(numbers[2], ANGLE) if len(numbers) > 2 else 0.0
    except UnitError as error:
        detail = f" ({error.detail})" if error.detail else ""
        message = f"the place '{name}': a number {error.message}{detail}"
        raise AnswerError(ANSWER.at(None, message, help=error.help)) from None
    if max(abs(x), abs(y)) > FARTHEST:
        help_text = f"use places within {FARTHEST:.0f} m, and move it in the file"
        raise AnswerError(ANSWER.at(None, f"the place '{name}' is very far away", help=help_text))
    return Place(name, x, y, heading)
