"""Judge from the probes that a session has sent whether it still carries data. Pure: no bus, no clock."""

from __future__ import annotations

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

    def judge(self, heard: ProbeResult, *, is_router_up: bool) -> bool:
        """Evaluate the result of a probe; return whether the session is stuck and must be reopened.

        After a renewal that did not help, it waits for twice as many misses.
        """
        if heard is ProbeResult.ANSWER:
            self._misses, self._bound = 0, MISSES
        elif heard is ProbeResult.NOTHING or (self._expects_router and is_router_up):
            self._misses += 1
        if self._misses < self._bound:
            return False
        self._misses, self._bound = 0, min(2 * self._bound, MOST_MISSES)
        return True
