"""Between a servo and its joint: gears, or a measured table. Angles are those of the servo [rad]."""

from __future__ import annotations

import math
from typing import Protocol

from rbxcompose.control.calibration import Calibration
from rbxcompose.dataclass import dataclass

NUDGE = 1e-4  # [rad], over which a table's slope is taken


class Transmission(Protocol):
    """From the angle of a servo to the position of its joint [rad or m], and back."""

    def position(self, angle: float) -> float:
        """Return the position of the joint."""

    def angle(self, position: float) -> float:
        """Return the angle of the servo."""

    def slope(self, angle: float) -> float:
        """Return how much the joint moves for each radian of the servo, there."""


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
