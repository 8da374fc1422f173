"""A joint that slides, driven by an actuator whose readings are calibrated: a lift of a torso, for example.

Positions are metres, times robot time [s].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rbxcompose.control.calibration import Calibration
from rbxcompose.control.limits import MotionLimits


@dataclass(frozen=True, slots=True)
class LinearJoint:
    """A joint that an actuator moves up or down at a set speed, and a reading that tells where it is.

    ValueError if the range of `limits` is not within that of the calibration.
    """

    calibration: Calibration
    """Pairs of reading and position [m]."""
    limits: MotionLimits
    dead_band: float = 0.01
    """Within this of the wanted position the joint stands still [m]."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.dead_band) and self.dead_band >= 0.0):
            raise ValueError(f"a dead band of {self.dead_band} m is none")
        low, high = self.span
        for name, value in (("lower", self.limits.lower), ("upper", self.limits.upper)):
            if value is not None and not low <= value <= high:
                raise ValueError(
                    f"the limit '{name}' of {value:g} m is beyond the calibration: {low:g} m to {high:g} m"
                )

    @property
    def span(self) -> tuple[float, float]:
        """The least and the greatest position of the calibration [m]."""
        ends = self.calibration.pairs[0][1], self.calibration.pairs[-1][1]
        return min(ends), max(ends)

    def position(self, reading: float) -> float | None:
        """Return the position [m] of a reading; None if it is no finite number or beyond the calibration."""
        first, last = self.calibration.pairs[0][0], self.calibration.pairs[-1][0]
        return self.calibration.value(reading) if first <= reading <= last else None

    def reading(self, position: float) -> float:
        """Return the reading at a position [m], clamped to the limits."""
        return self.calibration.inverse(self.limits.clamped(position))

    def direction(self, wanted: float, position: float | None, *, moving: int = 0) -> int:
        """Return where to move: 1 up, -1 down, 0 to stand still; without a position it stands still.

        A joint that moves (`moving` is 1 or -1) goes on until it has reached or passed the wanted position, so that it
        does not stop at the edge of the dead band and start again.
        """
        if position is None or not math.isfinite(wanted):
            return 0
        gap = self.limits.clamped(wanted) - position
        if moving and gap * moving > 0.0:
            return moving
        return 0 if abs(gap) <= self.dead_band else int(math.copysign(1, gap))
