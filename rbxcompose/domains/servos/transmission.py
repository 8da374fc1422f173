"""Between a servo and its joint: gears, or a measured table."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Sequence
from functools import cached_property

from rbxcompose.base.dataclass import dataclass

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


NUDGE = 1e-4  # [rad], over which a table's slope is taken


@dataclass(frozen=True, slots=True)
class Gear:
    """The servo turns `ratio` times for each turn of the joint, which is at `offset` [rad] when the servo is at 0.

    ValueError if the ratio is no finite number, or 0.
    """

    ratio: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.ratio) and self.ratio and math.isfinite(self.offset)):
            raise ValueError(f"with a ratio of {self.ratio:g} no angle of the servo belongs to a position")

    def position(self, angle: float) -> float:
        """Return the position of the joint [rad]."""
        return angle / self.ratio + self.offset

    def angle(self, position: float) -> float:
        """Return the angle of the servo."""
        return (position - self.offset) * self.ratio

    def slope(self, angle: float) -> float:
        """Return how much the joint turns for each radian of the servo."""
        return 1.0 / self.ratio


@dataclass(frozen=True, slots=True)
class Measured:
    """A table of angles and positions, such as that of a lift on a spindle; beyond it, its ends hold."""

    table: Calibration

    def position(self, angle: float) -> float:
        """Return the position of the joint."""
        return self.table.value(angle)

    def angle(self, position: float) -> float:
        """Return the angle of the servo."""
        return self.table.inverse(position)

    def slope(self, angle: float) -> float:
        """Return how much the joint moves for each radian of the servo; beyond the table, as at its ends."""
        first, last = self.table.pairs[0][0], self.table.pairs[-1][0]
        at = max(first + NUDGE, min(last - NUDGE, angle))
        return (self.table.value(at + NUDGE) - self.table.value(at - NUDGE)) / (2 * NUDGE)


Transmission = Gear | Measured
"""From the angle of a servo, counted from neutral, to the position of a joint and back."""
