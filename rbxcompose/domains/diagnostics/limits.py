"""A number against its limits, with hysteresis and patience."""

from __future__ import annotations

import math

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level


@dataclass(frozen=True, slots=True)
class Limits:
    """Where a number is a warning or an error, below and above.

    A level that it has reached lasts until the number is back by `hysteresis`; a worse one counts once the number has
    been there for `patience` [s].
    """

    warn_below: float = -math.inf
    error_below: float = -math.inf
    warn_above: float = math.inf
    error_above: float = math.inf
    hysteresis: float = 0.0
    patience: float = 0.0

    def level(self, number: float, *, since: Level = Level.OK) -> Level:
        """Return the level of a number if the level before was `since`; what is not finite is an ERROR."""
        if not math.isfinite(number):
            return Level.ERROR
        error, warn = (self.hysteresis if since >= level else 0.0 for level in (Level.ERROR, Level.WARN))
        if number < self.error_below + error or number > self.error_above - error:
            return Level.ERROR
        if number < self.warn_below + warn or number > self.warn_above - warn:
            return Level.WARN
        return Level.OK


class LimitCore:
    """The level of a number over time; all times in [s]."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.level = Level.OK
        self._worse_since: float | None = None  # the number has been beyond another limit

    def feed(self, now: float, number: float) -> Level:
        """Take a number and return the level."""
        found = self.limits.level(number, since=self.level)
        if found <= self.level:
            self.level, self._worse_since = found, None
            return self.level
        if self._worse_since is None:
            self._worse_since = now
        if now - self._worse_since >= self.limits.patience:
            self.level, self._worse_since = found, None
        return self.level
