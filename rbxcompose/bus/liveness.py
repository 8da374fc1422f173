"""Judging from probes and roll calls whether a session still carries data. Pure: time is an argument."""

import json
from collections.abc import Iterable
from enum import Enum, auto

from rbxcompose.bus.names import admin_key

MISSES = 3  # consecutive probes without an answer after which a session counts as stuck
MOST_MISSES = 96  # for a session that was reopened again and again without success


def probe_key(robot: str) -> str:
    """Return the key at which all processes of a robot probe and answer each other."""
    return admin_key(robot, "probe")


class ProbeResult(Enum):
    """The result of a probe by the time the next one is due."""

    ANSWER = auto()  # from anybody: the session carries data
    NOTHING = auto()  # there is a route to somebody, but nothing comes back
    NOBODY = auto()  # there is no route to anybody


class Probe:
    """Counts missed probes.

    Where the router must answer (`expects_router`), `NOBODY` is a miss as well, unless the router is down: then the
    router has to come back. A router from elsewhere need not know probes, and a process may be alone with it.
    """

    def __init__(self, *, expects_router: bool) -> None:
        self._expects_router = expects_router
        self._misses = 0
        self._bound = MISSES

    @property
    def is_in_doubt(self) -> bool:
        """Return whether the last probe was missed, so that the next goes to all; else it goes to the nearest."""
        return self._misses > 0

    def judge(self, received: ProbeResult, *, is_router_up: bool) -> bool:
        """Evaluate the result of a probe; return whether the session is stuck and must be reopened.

        After a renewal that did not help, it waits for twice as many misses.
        """
        if received is ProbeResult.ANSWER:
            self._misses, self._bound = 0, MISSES
        elif received is ProbeResult.NOTHING or (self._expects_router and is_router_up):
            self._misses += 1
        if self._misses < self._bound:
            return False
        self._misses, self._bound = 0, min(2 * self._bound, MOST_MISSES)
        return True


CALLS, MOST_CALLS = 3, 96  # that a process must miss until the session counts as broken: the first time, and at most


def roll_key(robot: str, host: str) -> str:
    """Return the key at which the processes of a host call the roll; no link to another host carries it."""
    return admin_key(robot, f"roll/{host or 'here'}")


class PeerCheck:
    """The roll as the process `name` calls it; `answer` is what it answers to others."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._missed: dict[str, int] = {}  # process that others hear -> calls in a row
        self._calls = CALLS
        self.answer = _answer(name, ())

    def judge(self, answers: Iterable[bytes]) -> list[str]:
        """Take all answers to a call; return the processes for whose sake the session must be opened again."""
        received_by = dict(filter(None, map(_parsed, answers)))
        received_by.pop(self._name, None)
        self.answer = _answer(self._name, received_by)
        known = {message for received in received_by.values() for message in received} - {self._name}
        self._missed = {one: self._missed.get(one, 0) + 1 for one in known - received_by.keys()}
        if not self._missed:
            self._calls = CALLS if known else self._calls
            return []
        # Of two that miss each other, one is enough, unless it does not help.
        patience = self._calls if self._name < min(self._missed) else 2 * self._calls
        lost = sorted(text for text, times in self._missed.items() if times >= patience)
        if lost:
            self._missed, self._calls = {}, min(2 * self._calls, MOST_CALLS)
        return lost


def _answer(name: str, received: Iterable[str]) -> bytes:
    return json.dumps([name, sorted(received)]).encode()


def _parsed(answer: bytes) -> tuple[str, list[str]] | None:
    """Return who answered and whom it has heard; None from another version."""
    try:
        data = json.loads(answer)
    except (ValueError, RecursionError):
        return None
    match data:
        case [str(name), [*received]]:
            return name, [message for message in received if isinstance(message, str)]
    return None
