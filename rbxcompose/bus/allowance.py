"""How many messages a second an input takes. Pure: time is an argument."""

from __future__ import annotations

import math

BURST = 0.1  # [s]; what may come in this time may also come all at once
MOST_SOURCES = 16  # sources with an allowance of their own
QUIET = 1.0  # [s] of silence after which a source makes room for another one


class Allowance:
    """A token bucket: at most `rate` messages a second [Hz] in the long run."""

    def __init__(self, rate: float, burst: float = BURST) -> None:
        self.rate = rate
        self._most = max(1.0, rate * burst)
        self._left = self._most
        self._filled = -math.inf

    def is_quiet(self, now: float) -> bool:
        """Return whether nothing has come for a while."""
        return now - self._filled > QUIET

    def takes(self, now: float) -> bool:
        """Return whether to take a message that arrives at `now` [s]."""
        self._left = min(self._most, self._left + max(0.0, now - self._filled) * self.rate)
        self._filled = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class Allowances:
    """An allowance for each source, so that one that sends too much costs the others nothing.

    Beyond `MOST_SOURCES`, new sources share one; else a sender could evade the limit with a new name for each message.
    """

    def __init__(self, rate: float, burst: float = BURST) -> None:
        self._rate, self._burst = rate, burst
        self._strangers = Allowance(rate, burst)
        self._own: dict[bytes, Allowance] = {}

    def takes(self, source: bytes, now: float) -> bool:
        """Return whether to take a message of a source that arrives at `now` [s]."""
        return (self._own.get(source) or self._of_new(source, now)).takes(now)

    def _of_new(self, source: bytes, now: float) -> Allowance:
        if len(self._own) >= MOST_SOURCES:
            self._own = {name: one for name, one in self._own.items() if not one.is_quiet(now)}
        if len(self._own) >= MOST_SOURCES:
            return self._strangers
        return self._own.setdefault(source, Allowance(self._rate, self._burst))
