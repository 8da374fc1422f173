"""At which share of its own speed a trajectory passes: people slow it down, hold it, and let it go on.

Its joints stay on their curves, since only time is stretched; all of them slow down together, as hard as the one that
decelerates worst can.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from rbxcompose.control.curves import JointSample

FASTEST = 5.0  # [1/s], at which the share changes where no joint is in a hurry
SPARE = 0.1  # of the acceleration of a joint, by which a change may exceed it, so that it is always possible

Demand = tuple[JointSample, float | None]
"""Where a joint is at full speed, and its greatest acceleration."""


class TrajectoryPace:
    """From robot time to the time of one trajectory at a time, both [s]."""

    def __init__(self) -> None:
        self.share = 1.0
        """What is wanted, from 0 to 1."""
        self.begin(0.0, is_at_rest=True)

    def begin(self, now: float, *, is_at_rest: bool) -> None:
        """Let a trajectory begin; joints that move go on as fast as they do, and change their pace from there."""
        self._rate, self._change = self.share if is_at_rest else 1.0, 0.0
        self._late, self._passed = 0.0, now

    def time(self, now: float) -> float:
        """Return the robot time at which a trajectory that nobody slows down would be where this one is."""
        return now - self._late - (1.0 - self._rate) * max(0.0, now - self._passed)

    def scaled(self, sample: JointSample) -> JointSample:
        """Return what a sample at full speed is at the present one."""
        acceleration = sample.acceleration * self._rate**2 + sample.velocity * self._change
        return JointSample(sample.position, sample.velocity * self._rate, acceleration)

    def advance(self, now: float, demands: Iterable[Demand]) -> None:
        """Let time pass, and change the pace towards what is wanted, as `demands` allow from now on."""
        self._late, dt, self._passed = now - self.time(now), now - self._passed, max(now, self._passed)
        missing = self.share - self._rate
        if dt <= 0.0 or missing == 0.0:
            self._change = 0.0
            return
        low, high = -FASTEST, FASTEST
        for sample, most in demands:
            if most is not None and sample.velocity:
                hard = sample.acceleration * self._rate**2
                room = max(most, abs(hard)) + SPARE * most
                ends = sorted(((-room - hard) / sample.velocity, (room - hard) / sample.velocity))
                low, high = max(low, ends[0]), min(high, ends[1])
        self._change = min(high, max(low, missing / dt))
        self._rate = self.share if self._change == missing / dt else self._rate + self._change * dt

    def arrive(self, now: float, end: float) -> None:
        """Let time pass as ever from the end of the trajectory on."""
        self._late, self._rate, self._change, self._passed = now - end, 1.0, 0.0, now


def share_mistake(share: float) -> str:
    """Return why a share is none; nothing if it is one."""
    return "" if math.isfinite(share) and 0.0 <= share <= 1.0 else "a speed is from 0 % to 100 % of that of the goal"
