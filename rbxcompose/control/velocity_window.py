"""The mean of a base's velocity over the last moments, which limits its jerk."""

from __future__ import annotations

from collections import deque

from rbxcompose.geometry import AT_REST, Velocity2


class VelocityWindow:
    """Averages a velocity over the last `duration` [s]; between two steps it is a straight line.

    The acceleration of the mean is (v(t) - v(t - duration)) / duration. If that of v is at most a, the jerk is at most
    2 a / duration. A mean exceeds no limit of its values, and does not leave the line on which they are.
    """

    def __init__(self, duration: float) -> None:
        self.duration = duration
        self._steps: deque[tuple[float, Velocity2, Velocity2]] = deque()  # how long each took, from where to where
        self._last = AT_REST

    def add(self, velocity: Velocity2, dt: float) -> Velocity2:
        """Return the mean when the velocity has become `velocity` within `dt` [s]; before the first step it was 0."""
        before, self._last = self._last, velocity
        if self.duration <= 0.0:
            return velocity
        self._steps.append((dt, before, velocity))
        linear = angular = 0.0
        left, used = self.duration, 0
        for length, start, end in reversed(self._steps):
            if left <= 0.0:
                break
            used += 1
            part = min(length, left)
            middle = 1.0 - part / length / 2.0  # the mean of the last part of a straight line
            linear += part * (start.linear + (end.linear - start.linear) * middle)
            angular += part * (start.angular + (end.angular - start.angular) * middle)
            left -= part
        while len(self._steps) > used:
            self._steps.popleft()
        return Velocity2(linear / self.duration, angular / self.duration)
