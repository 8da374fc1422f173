"""Judges whether a session reaches all processes that others reach. Pure: no bus, no clock.

Zenoh dials a process that it has found once only. If such a link is lost, the two never hear each other again, though
both hear all others. So the processes of a host call the roll: each answers with its name, and with whom it has heard.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from rbxcompose.bus.names import admin_key

CALLS, MOST_CALLS = 3, 96  # that a process must miss until the session counts as broken: the first time, and at most


def roll_key(robot: str, host: str) -> str:
    """Return the key at which the processes of a host call the roll; no link to another host carries it."""
    return admin_key(robot, f"roll/{host or 'here'}")


class RollCall:
    """The roll as the process `name` calls it; `answer` is what it answers to others."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._missed: dict[str, int] = {}  # process that others hear -> calls in a row
        self._calls = CALLS
        self.answer = _answer(name, ())

    def judge(self, answers: Iterable[bytes]) -> list[str]:
        """Take all answers to a call; return the processes for whose sake the session must be opened again."""
        heard_by = dict(filter(None, map(_told, answers)))
        heard_by.pop(self._name, None)
        self.answer = _answer(self._name, heard_by)
        known = {one for heard in heard_by.values() for one in heard} - {self._name}
        self._missed = {one: self._missed.get(one, 0) + 1 for one in known - heard_by.keys()}
        if not self._missed:
            self._calls = CALLS if known else self._calls
            return []
        # Of two that miss each other, one is enough, unless it does not help.
        patience = self._calls if self._name < min(self._missed) else 2 * self._calls
        lost = sorted(one for one, times in self._missed.items() if times >= patience)
        if lost:
            self._missed, self._calls = {}, min(2 * self._calls, MOST_CALLS)
        return lost


def _answer(name: str, heard: Iterable[str]) -> bytes:
    return json.dumps([name, sorted(heard)]).encode()


def _told(answer: bytes) -> tuple[str, list[str]] | None:
    """Return who answered and whom it has heard; None from another version."""
    try:
        told = json.loads(answer)
    except (ValueError, RecursionError):
        return None
    match told:
        case [str(name), [*heard]]:
            return name, [one for one in heard if isinstance(one, str)]
    return None
