"""A joint that is driven up or down at a set speed until it has arrived: a lift, for example.

Positions are metres, times robot time [s].
"""

from __future__ import annotations

import math

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.limits import stopping_speed

CREEP = 0.1  # of its speed, below which it does not slow down before it has arrived
MOVES = 0.02  # of its speed: slower than this it is stuck


@dataclass(frozen=True, slots=True)
class LinearPolicy:
    """How a joint goes to a position. ValueError if it cannot."""

    speed: float
    """[m/s], above 0."""
    dead_band: float = 0.01
    """Within this of the wanted position it has arrived [m]."""
    stall_after: float = 2.0
    """Without progress for this long [s], it is stuck."""
    acceleration: float | None = None
    """With which it brakes [m/s^2]; None is at once."""

    def __post_init__(self) -> None:
        for what, value in (("speed", self.speed), ("dead band", self.dead_band), ("time", self.stall_after)):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"a {what} of {value} is none")


class LinearMove:
    """One way to a position.

    A joint that is within the dead band at the beginning does not move; one that moves goes on to the wanted position,
    not to the edge of the dead band.
    """

    def __init__(self, policy: LinearPolicy, wanted: float, position: float, now: float) -> None:
        self.policy, self.wanted = policy, wanted
        self.is_over = abs(wanted - position) <= policy.dead_band
        self.failure = ""
        """Why it ended before it had arrived."""
        self._direction = math.copysign(1.0, wanted - position)
        self._best, self._since = abs(wanted - position), now  # how near it came, and when [m, s]

    def step(self, position: float, now: float, dt: float) -> float:
        """Return with which velocity to move up to `now + dt` [m/s]; 0 when it is over."""
        gap = self.wanted - position
        has_passed, is_near = gap * self._direction <= 0.0, abs(gap) <= self.policy.dead_band
        self._watch(gap, now)
        if self.is_over or (has_passed and is_near):
            self.is_over = True
            return 0.0
        self._direction = math.copysign(1.0, gap)
        braking = stopping_speed(abs(gap), dt, self.policy.acceleration)
        return self._direction * min(self.policy.speed, max(braking, CREEP * self.policy.speed))

    def _watch(self, gap: float, now: float) -> None:
        """End when there is no progress."""
        policy = self.policy
        if abs(gap) < self._best - MOVES * policy.speed * policy.stall_after:
            self._best, self._since = abs(gap), now
        if now - self._since >= policy.stall_after and not self.is_over:
            self.is_over = True
            if abs(gap) > policy.dead_band:
                self.failure = f"it has not moved for {policy.stall_after:g} s, {abs(gap):.3g} m before its goal"
