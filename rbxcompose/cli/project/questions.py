"""Questions at the terminal; without a terminal, defaults answer them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from io import TextIOWrapper
from typing import TypeVar

from rbxcompose.cli.output.console import refuse
from rbxcompose.scaffold.answers import AnswerError

T = TypeVar("T")
Read = Callable[[str], T]


class CancelledError(Exception):
    """Raised when a person stops answering (Ctrl-D)."""


class Asker:
    """Asks, or takes given answers; `is_asking` is whether somebody is there to answer."""

    def __init__(self, *, is_asking: bool) -> None:
        self.is_asking = is_asking and sys.stdin.isatty()
        if self.is_asking and isinstance(sys.stdin, TextIOWrapper):
            sys.stdin.reconfigure(errors="replace")  # a key that sends invalid UTF-8 is a wrong letter, not an abort

    def ask(self, question: str, read: Read[T], default: str, *, given: str | None = None) -> T:
        """Return what `read` makes of the answer; report a refused answer and ask again.

        Raises:
            AnswerError: if `given`, or the default, is refused.
            CancelledError: if there is no answer.
        """
        if given is not None or not self.is_asking:
            return read(default if given is None else given)
        while True:
            try:
                return read(_line(f"{question} [{default}]: ") or default)
            except AnswerError as error:
                refuse(error.finding)

    def ask_several(self, question: str, read: Callable[[str, list[T]], T]) -> list[T]:
        """Return what `read` makes of each answer and those before it, until an empty one; none if nobody is there."""
        found: list[T] = []
        while self.is_asking and (text := _line(f"{question}: ")):
            try:
                found.append(read(text, found))
            except AnswerError as error:
                refuse(error.finding)
        return found


def _line(prompt: str) -> str:
    sys.stdout.write(prompt)
    sys.stdout.flush()
    text = sys.stdin.readline()
    if not text:
        sys.stdout.write("\n")
        raise CancelledError
    return text.strip()
