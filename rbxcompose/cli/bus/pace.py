"""Pure core of `topic hz`: how often and how evenly messages arrive."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise

from rbxcompose.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Pace:
    """Figures of the intervals between arrivals; `jitter` is their standard deviation."""

    rate: float  # [Hz]
    shortest: float  # [s]
    longest: float  # [s]
    jitter: float  # [s]
    messages: int


class PaceMeter:
    """Keeps the times of the last `window` arrivals."""

    def __init__(self, window: int) -> None:
        self._times: deque[float] = deque(maxlen=window)
        self._news = 0

    def arrived(self, time: float) -> None:
        """Count an arrival at `time` [s]."""
        self._times.append(time)
        self._news += 1

    def take(self) -> Pace | None:
        """Return the pace; None if nothing has arrived since the last call, or too little to measure."""
        news, self._news = self._news, 0
        return measured(list(self._times)) if news else None


def measured(times: Sequence[float]) -> Pace | None:
    """Return the pace of arrivals at these times [s]; None for fewer than two different times."""
    if len(times) < 2 or times[-1] <= times[0]:
        return None
    intervals = [after - before for before, after in pairwise(times)]
    mean = (times[-1] - times[0]) / len(intervals)
    jitter = math.sqrt(sum((one - mean) ** 2 for one in intervals) / len(intervals))
    return Pace(1 / mean, min(intervals), max(intervals), jitter, len(times))
