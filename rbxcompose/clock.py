"""Robot time: the one clock that everything else is given, real or stepped.

Robot time counts seconds from the start of the robot, on every host process alike. Motion deadlines use it and
nothing else; wall-clock stamps are data for people and other programs, never a deadline.
"""

from __future__ import annotations

import time
from typing import Protocol

NANOSECONDS = 1_000_000_000


class Clock(Protocol):
    """What tells the time: robot time for decisions, a stamp for messages."""

    def now(self) -> float:
        """Return robot time [s] since the robot's start."""
        ...

    def stamp(self) -> int:
        """Return the time to write into messages [ns]: since the Unix epoch, or robot time if stepped."""
        ...


class MonotonicClock:
    """Real time: `CLOCK_MONOTONIC` counted from `start`, shared by all processes of one robot."""

    def __init__(self, start: float | None = None) -> None:
        self.start = time.monotonic() if start is None else start

    def now(self) -> float:
        """Return robot time [s]."""
        return time.monotonic() - self.start

    def stamp(self) -> int:
        """Return wall-clock time [ns] since the Unix epoch."""
        return time.time_ns()


class SteppedClock:
    """Simulated time: stands still until `advance_to` moves it, never backwards."""

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def now(self) -> float:
        """Return robot time [s]."""
        return self._now

    def stamp(self) -> int:
        """Return robot time [ns], so that a second run writes the same stamps."""
        return round(self._now * NANOSECONDS)

    def advance_to(self, t: float) -> None:
        """Jump to robot time `t` [s].

        Raises:
            ValueError: if `t` lies in the past.
        """
        if t < self._now:
            raise ValueError(f"robot time cannot run backwards: {t} s is before {self._now} s")
        self._now = t
