"""Which servos to ask now: one that stays silent is skipped, and probed now and then. Pure: time is an argument [s]."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

from rbxcompose.actuation.bus import ServoStatistics


class Attention:
    """Keeps the statistics of servos, and skips those that missed `patience` reads in a row.

    One of those is probed each `period` [s], so that at most one silent servo costs its timeout in one cycle. The
    period is short against the time after which a joint without measurements is a fault: a few lost replies are none.
    """

    def __init__(self, patience: int = 3, period: float = 0.1) -> None:
        self.patience, self.period = patience, period
        self.statistics: defaultdict[int, ServoStatistics] = defaultdict(ServoStatistics)
        self._probed: dict[int, float] = {}

    def of(self, id: int) -> ServoStatistics:
        """Return the statistics of a servo."""
        return self.statistics[id]

    def is_silent(self, id: int) -> bool:
        """Tell whether a servo is skipped."""
        return self.statistics[id].misses >= self.patience

    def due(self, ids: Iterable[int], now: float) -> list[int]:
        """Return whom to ask: those that answer in their order, then doubtful ones, then at most one probe.

        Those that may be silent are last, because some servos that follow a silent one keep waiting for it.
        """
        asked: list[int] = []
        doubtful: list[tuple[int, int]] = []
        for one in ids:
            misses = self.statistics[one].misses
            if misses:
                doubtful.append((misses, one))
            else:
                asked.append(one)
        asked += [one for misses, one in sorted(doubtful) if misses < self.patience]
        return asked + self._probe([one for misses, one in doubtful if misses >= self.patience], now)

    def _probe(self, silent: list[int], now: float) -> list[int]:
        waiting = [one for one in silent if now - self._probed[one] >= self.period]
        for chosen in sorted(waiting, key=self._probed.__getitem__)[:1]:
            self._probed[chosen] = now
            return [chosen]
        return []

    def answered(self, id: int, now: float) -> None:
        """Note a reply."""
        known = self.statistics[id]
        known.reads += 1
        known.misses, known.last_seen = 0, now

    def missed(self, id: int, now: float, *, is_corrupt: bool) -> None:
        """Note that a read has failed in all of its attempts."""
        known = self.statistics[id]
        known.misses += 1
        if is_corrupt:
            known.errors += 1
        else:
            known.timeouts += 1
        if known.misses == self.patience:
            self._probed[id] = now

    def forgive(self) -> None:
        """Ask all again, after the bus was opened again."""
        self._probed.clear()
        for known in self.statistics.values():
            known.misses = 0
