"""Timing with less jerk: the path is that of TOPP-RA to the point, how fast it is followed is a mean over a moment.

Let s(t) be how far along the path it is, with a speed that has kinks and an acceleration that jumps. Its mean over the
last `window` seconds is as far along the same path, begins and ends at rest with no acceleration, and takes `window`
longer. If the acceleration of s is at most a, the jerk of its mean is at most 2 a / window.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PathTiming:
    """Places on a path `way` [rad or m] of shape (k,), and the `speeds` there; accelerations between them are constant.

    The first and the last speed are 0, the others above.
    """

    way: Array
    speeds: Array

    @property
    def times(self) -> Array:
        """Return when each place is reached [s]."""
        return np.concatenate([[0.0], np.cumsum(2 * np.diff(self.way) / (self.speeds[1:] + self.speeds[:-1]))])

    def mean(self, window: float, count: int) -> tuple[Array, Array, Array]:
        """Return times [s], and the mean place and speed over the last `window` seconds, each of shape (count,)."""
        end = float(self.times[-1])
        times = np.linspace(0.0, end + window, count)
        (place, sum_), (place_before, sum_before) = self._at(times), self._at(times - window)
        return times, np.clip((sum_ - sum_before) / window, 0.0, self.way[-1]), (place - place_before) / window

    def _at(self, when: Array) -> tuple[Array, Array]:
        """Return places at some times, before, while or after it moves, and the integral of the place until then."""
        times, steps = self.times, np.diff(self.times)
        slopes = np.diff(self.speeds) / steps
        parts = steps * (self.way[:-1] + steps * (self.speeds[:-1] / 2 + steps * slopes / 6))
        sums = np.concatenate([[0.0], np.cumsum(parts)])
        inside = np.clip(when, 0.0, times[-1])
        index = np.clip(np.searchsorted(times, inside, side="right") - 1, 0, len(steps) - 1)
        t, speed, slope = inside - times[index], self.speeds[index], slopes[index]
        place = self.way[index] + t * (speed + t * slope / 2)
        sum_ = sums[index] + t * (self.way[index] + t * (speed / 2 + t * slope / 6))
        return place, sum_ + np.maximum(0.0, when - times[-1]) * self.way[-1]


def jerks_of(space: JointSpace) -> Array | None:
    """Return the greatest jerks of joints, of shape (n,), inf for those without a limit; None if no joint has one."""
    found = [np.inf if one.limits.jerk is None else one.limits.jerk for one in space.joints]
    return np.array(found) if min(found) < np.inf else None


def jerks_between(times: Array, velocities: Array) -> Array:
    """Return how fast the mean acceleration changes from one interval to the next, of shape (m, n).

    `velocities` have the shape (m, n) at `times` [s] of shape (m,). At both ends the acceleration is 0.
    """
    steps = np.diff(times)
    accelerations = np.diff(velocities, axis=0) / steps[:, None]
    apart = np.concatenate((steps[:1] / 2, (steps[1:] + steps[:-1]) / 2, steps[-1:] / 2))
    still = np.zeros((1, velocities.shape[1]))
    return np.asarray(np.diff(np.concatenate((still, accelerations, still)), axis=0) / apart[:, None])
