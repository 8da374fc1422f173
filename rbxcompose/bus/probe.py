"""Whether a session still carries data, judged from the probes that it has sent. Pure: no bus, no clock."""

from __future__ import annotations

from enum import Enum, auto

from rbxcompose.bus.names import admin_key

MISSES = 3  # probes in a row without an answer that make a session stuck
MOST_MISSES = 96  # for one that was opened again and again without success


def probe_key(robot: str) -> str:
    """Return the key at which all processes of a robot ask, and answer, each other."""
    return admin_key(robot, "probe")


class ProbeResult(Enum):
    """What became of a probe by the time when the next one is due."""

    ANSWER = auto()  # of anybody: the session carries data
    NOTHING = auto()  # there is a way to somebody, and nothing comes back
    NOBODY = auto()  # there is no way to anybody


class Probe:
    """Counts probes that were missed.

    Where the router must answer (`expects_router`), `NOBODY` is a miss as well, unless the router is down: then that
    has to come back. A router from elsewhere need not know probes, and a process may be alone with it.
    """

    def __init__(self, *, expects_router: bool) -> None:
        self._expects_router = expects_router
        self._misses = 0
        self._bound = MISSES

    @property
    def is_in_doubt(self) -> bool:
        """Return whether the last probe was missed, so that the next one goes to all; else whoever is near will do."""
        return self._misses > 0

    def judge(self, heard: ProbeResult, *, is_router_up: bool) -> bool:
        """Take what became of a probe; return whether the session is stuck, to be opened again.

        After a renewal that did not help, twice as many misses are waited for.
        """
        if heard is ProbeResult.ANSWER:
            self._misses, self._bound = 0, MISSES
        elif heard is ProbeResult.NOTHING or (self._expects_router and is_router_up):
            self._misses += 1
        if self._misses < self._bound:
            return False
        self._misses, self._bound = 0, min(2 * self._bound, MOST_MISSES)
        return True
