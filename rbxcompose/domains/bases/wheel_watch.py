"""Whether a wheel of a base does what it is commanded, by what it has turned."""

from __future__ import annotations

import math
from collections import deque

SOON, LATER = 0.5, 1.0  # [s] of commands in one direction, after which its speed counts, and that it stands
BACKWARDS = 0.25, 0.01  # of the commanded way, and [m] besides: further back is the wrong way
SLOWING = 0.4  # of the way, in the last half of its time: less is a wheel that slows down
TOO_FAR = 2.0, 0.05  # of the commanded way, and [m] besides: further is too fast
STANDS = 0.1, 0.05  # of the commanded way, if that is at least so long [m]: less is none


class WheelWatch:
    """Compares the way of a wheel with the commanded one, while that has one direction.

    A wheel may lag, and one that is commanded to rest may be pushed: neither is a fault.
    """

    def __init__(self) -> None:
        self._direction = self._commanded = self._turned = 0.0
        self._past: deque[tuple[float, float, float]] = deque()  # time, and both ways [m]

    def update(self, speed: float, turned: float, now: float) -> None:
        """Take the commanded speed [m/s], and how far the wheel has turned [m] since the last time, at `now` [s]."""
        past, direction = self._past, math.copysign(1.0, speed) if speed else 0.0
        if direction != self._direction:
            past.clear()
            self._direction = direction
        elif past:
            self._commanded += abs(speed) * (now - past[-1][0])
            self._turned += turned * direction
        past.append((now, self._commanded, self._turned))
        while len(past) > 1 and past[1][0] <= now - LATER:
            past.popleft()

    def fault(self, *, is_urgent: bool) -> str:
        """Return what the wheel does wrong, else an empty text; if it is urgent, by what is known so far."""
        commanded, turned = self._over(SOON, is_urgent=is_urgent)
        _, lately = self._over(SOON / 2, is_urgent=is_urgent)
        slack = 0.0 if is_urgent else BACKWARDS[1]
        if turned < -BACKWARDS[0] * commanded - slack and lately < SLOWING * turned:
            return "turns the wrong way"
        if turned > TOO_FAR[0] * commanded + TOO_FAR[1]:
            return "is far faster than commanded"
        commanded, turned = self._over(LATER, is_urgent=is_urgent)
        return "stands" if (is_urgent or commanded >= STANDS[1]) and turned < STANDS[0] * commanded else ""

    def _over(self, span: float, *, is_urgent: bool) -> tuple[float, float]:
        """Return the ways over the last `span` [s]; as long as the direction is newer, none, or all if it is urgent."""
        if not self._past:
            return 0.0, 0.0
        now, commanded, turned = self._past[-1]
        old = [each for each in self._past if each[0] <= now - span + 1e-6]
        _, begun, was = old[-1] if old else self._past[0 if is_urgent else -1]
        return commanded - begun, turned - was
