"""Finds links that only seem to be whole, from what hosts report of each other. Pure: time is an argument.

A router of Zenoh computes the ways to the others 0.1 s after a link was made or lost. If a link is lost and made again
meanwhile, it may not tell the other router what is subscribed to here, so one of the two does not hear the other. Nor
does it dial again if a link is lost as soon as it is made. Three kinds of evidence show this: a host that is heard does
not hear this one, it hears one that is not heard here, or no host is heard any more though there is a way to one.
"""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.dataclass import dataclass
from rbxcompose.runtime.clock_offset import Echo

FRESH = 1.0  # [s] since a report, after which it counts as missed; hosts report four times a second
PATIENCE, LONGEST = 2.0, 64.0  # [s] of evidence until links are opened again: the first time, and at most


@dataclass
class _Doubt:
    since: float
    latest: float  # both [s]


class DeafLinks:
    """Judges the links of one host."""

    def __init__(self, host: str, now: float) -> None:
        self._host, self._begun = host, now
        self._told, self._opened, self._sought = now, -LONGEST, now
        self._patience = PATIENCE
        self._heard: dict[str, float] = {}  # host -> when [s]
        self._doubts: dict[str, _Doubt] = {}

    def tell(self, now: float) -> None:
        """Take that this host reported."""
        self._told = now

    def hear(self, teller: str, sent: int, heard: Mapping[str, Echo], now: float) -> str | None:
        """Take a report, with what its host had heard until it was sent [ns, its clock].

        Returns the host to which the link must be opened again, if there is evidence for long enough.
        """
        self._heard[teller] = now
        if now - self._told > FRESH:
            self._doubts.clear()  # nobody can hear this host
            return None
        hears = {host for host, echo in heard.items() if (sent - echo.arrived) * 1e-9 < FRESH}
        if self._host in hears:
            self._doubts.pop(teller, None)
        unheard = {host for host in hears - {self._host} if now - self._heard.get(host, self._begun) > FRESH}
        for host in unheard if self._host in hears else {teller, *unheard}:
            if self._is_proven(host, now):
                return self._give_up(host, now)
        return None

    def must_seek(self, now: float) -> bool:
        """Return whether to seek a way to another host now, since none is heard any more."""
        if not self._is_alone(now) or now - self._sought < FRESH / 2:
            return False
        self._sought = now
        return True

    def find(self, now: float) -> bool:
        """Take that there is a way to another host; return whether all links must be opened again."""
        is_proven = self._is_alone(now) and self._is_proven("", now)
        if is_proven:
            self._give_up("", now)
        return is_proven

    def _is_alone(self, now: float) -> bool:
        return bool(self._heard) and now - max(self._heard.values()) > FRESH

    def _is_proven(self, host: str, now: float) -> bool:
        doubt = self._doubts.setdefault(host, _Doubt(now, now))
        if now - doubt.latest > FRESH:
            doubt.since = now  # what came before is of an earlier link
        doubt.latest = now
        return now - doubt.since > self._patience

    def _give_up(self, host: str, now: float) -> str:
        """Return the host, and wait longer for the next time unless all was well for a while."""
        is_again = now - self._opened < self._patience + LONGEST
        self._patience = min(2 * self._patience, LONGEST) if is_again else 2 * PATIENCE
        self._opened = now
        self._doubts.clear()
        return host
