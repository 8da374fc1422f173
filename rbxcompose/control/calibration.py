"""Measured pairs of numbers, read in both directions."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Sequence
from functools import cached_property

from rbxcompose.dataclass import dataclass

Pair = tuple[float, float]


@dataclass(frozen=True)
class Calibration:
    """Straight lines between `pairs`; outside of them the value is that of the nearest end.

    The first numbers increase. The second ones increase or decrease throughout, so that each belongs to one first
    number. ValueError with the reason otherwise.
    """

    pairs: tuple[Pair, ...]

    def __post_init__(self) -> None:
        if len(self.pairs) < 2:
            raise ValueError("a calibration needs two pairs or more")
        if not all(math.isfinite(value) for pair in self.pairs for value in pair):
            raise ValueError("a calibration has finite numbers only")
        falls = self.pairs[0][1] > self.pairs[1][1]
        for (x, y), (next_x, next_y) in itertools.pairwise(self.pairs):
            if next_x <= x:
                raise ValueError(f"in a calibration the first numbers increase, but {next_x:g} follows {x:g}")
            if next_y == y or (next_y < y) != falls:
                raise ValueError(f"in a calibration the second numbers go one way only, but {next_y:g} follows {y:g}")

    def value(self, x: float) -> float:
        """Return the second number at a first one."""
        return _interpolated(self.pairs, x)

    def inverse(self, y: float) -> float:
        """Return the first number at a second one."""
        return _interpolated(self._inverse, y)

    @cached_property
    def _inverse(self) -> tuple[Pair, ...]:
        return tuple(sorted((y, x) for x, y in self.pairs))


def _interpolated(pairs: Sequence[Pair], x: float) -> float:
    if x <= pairs[0][0]:
        return pairs[0][1]
    if x >= pairs[-1][0]:
        return pairs[-1][1]
    index = bisect_right(pairs, (x, math.inf))
    (left, low), (right, high) = pairs[index - 1], pairs[index]
    return low + (high - low) * (x - left) / (right - left)
