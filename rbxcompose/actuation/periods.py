"""How well a cycle keeps its time. Pure: times are arguments [s]."""

from __future__ import annotations

import math
from collections import deque

REMEMBERED = 1000  # cycles, of which the lateness is known


class Periods:
    """Counts the periods of a cycle on a grid; those that no cycle began in were missed."""

    def __init__(self, period: float) -> None:
        self.period = period
        self.met = self.missed = 0
        self._last: int | None = None  # number of the last period
        self._late: deque[float] = deque(maxlen=REMEMBERED)

    def begin(self, now: float) -> None:
        """Note that a cycle begins."""
        number = math.floor(now / self.period + 1e-6)
        if self._last is not None:
            self.missed += max(0, number - self._last - 1)
        self._last = number
        self.met += 1
        self._late.append(now - number * self.period)

    def pause(self) -> None:
        """Do not count what comes until the next cycle."""
        self._last = None

    @property
    def share_met(self) -> float:
        """Return the share of periods in which a cycle began."""
        return self.met / (self.met + self.missed) if self.met else 1.0

    def late(self, share: float) -> float:
        """Return how late this share of the last cycles began, at most [s]."""
        ordered = sorted(self._late)
        return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0.0
