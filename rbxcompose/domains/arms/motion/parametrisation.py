"""From the points of a path to a trajectory within the limits of joints, by TOPP-RA."""

from __future__ import annotations

import logging
import math
import sys
from functools import cache, lru_cache
from importlib import import_module
from itertools import pairwise
from types import ModuleType
from typing import Any

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.arms.motion.groups import JointSpace


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

    def at(self, when: Array) -> tuple[Array, Array]:
        """Return the places and the speeds at some times [s]."""
        return self._at(when)[:2]

    def mean(self, window: float, count: int) -> tuple[Array, Array, Array]:
        """Return times [s], and the mean place and speed over the last `window` seconds, each of shape (count,)."""
        end = float(self.times[-1])
        times = np.linspace(0.0, end + window, count)
        (place, _, sum_), (place_before, _, sum_before) = self._at(times), self._at(times - window)
        return times, np.clip((sum_ - sum_before) / window, 0.0, self.way[-1]), (place - place_before) / window

    def _at(self, when: Array) -> tuple[Array, Array, Array]:
        """Return places and speeds at some times, before, while or after it moves, and the integrals of the place."""
        times = self.times
        steps = np.diff(times)
        slopes = np.diff(self.speeds) / steps
        parts = steps * (self.way[:-1] + steps * (self.speeds[:-1] / 2 + steps * slopes / 6))
        sums = np.concatenate([[0.0], np.cumsum(parts)])
        inside = np.clip(when, 0.0, times[-1])
        index = np.clip(np.searchsorted(times, inside, side="right") - 1, 0, len(steps) - 1)
        t, speed, slope = inside - times[index], self.speeds[index], slopes[index]
        place = self.way[index] + t * (speed + t * slope / 2)
        sum_ = sums[index] + t * (self.way[index] + t * (speed / 2 + t * slope / 6))
        return place, speed + t * slope, sum_ + np.maximum(0.0, when - times[-1]) * self.way[-1]


def jerks_of(space: JointSpace) -> Array | None:
    """Return the greatest jerks of joints, of shape (n,), inf for those without a limit; None if no joint has one."""
    found = [np.inf if joint.limits.jerk is None else joint.limits.jerk for joint in space.joints]
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


MARGIN = 0.95
"""Share of the limits that is planned with: the rest is left to the limiter of each joint, to catch up."""
DEFAULT_SPEED = 1.0  # [rad/s or m/s] of a joint without a limit
SECONDS_TO_SPEED = 0.5  # [s] in which a joint without a limit of acceleration reaches its speed
BEND, LONGEST, LEAST_GRID = 1e-3, 0.05, 100  # [rad or m] of a step of the grid, and how many there are at least
LEAST_WINDOW, IN_WINDOW = 0.01, 4  # [s] over which speeds are averaged for limits of jerk; samples in this time
WINDOWS = (1.0, 0.5, 0.25, 0.125)  # shares of the time that keeps them for sure: the one that is done first is taken
UNUSED = ("matplotlib", "matplotlib.pyplot", "scipy", "scipy.interpolate", "scipy.sparse")  # of what toppra imports
SHORTEST = 1e-6  # of a straight line, on which the speed is constant
SAMPLE, LEAST_SAMPLES = 0.05, 12  # [s] between samples, and how many there are at least


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Points that a controller passes on cubic curves: `times` [s] of shape (m,), the others of shape (m, n)."""

    times: Array
    positions: Array
    velocities: Array

    @property
    def duration(self) -> float:
        """Return how long it takes [s]."""
        return float(self.times[-1])

    def slowed(self, factor: float) -> Trajectory:
        """Return the same way, which takes `factor` times as long."""
        return Trajectory(self.times * factor, self.positions, self.velocities / factor)

    def excess(self, velocities: Array, accelerations: Array) -> float:
        """Return by which factor it must be slowed down to keep limits of shape (n,); at most 1 if it keeps them."""
        h, first, second = np.diff(self.times)[:, None], self.velocities[:-1], self.velocities[1:]
        slope = np.diff(self.positions, axis=0) / h
        begin, end = (6 * slope - 4 * first - 2 * second) / h, (2 * first + 4 * second - 6 * slope) / h
        hardest = np.maximum(np.abs(begin), np.abs(end)).max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.clip(np.nan_to_num(begin / (begin - end)), 0.0, 1.0)  # where the acceleration is 0
        middle = first + h * (begin * turn + (end - begin) * turn**2 / 2)
        fastest = np.abs(np.stack((first, second, middle))).max(axis=(0, 1))
        return float(max(np.max(fastest / velocities), math.sqrt(np.max(hardest / accelerations))))

    def dense(self, step: float) -> Array:
        """Return positions on its curves, at most `step` [rad or m] apart in each joint, of shape (k, n)."""
        h, slope = np.diff(self.times)[:, None], np.diff(self.positions, axis=0)
        first, second = self.velocities[:-1] * h, self.velocities[1:] * h
        bend, twist = 3 * slope - 2 * first - second, first + second - 2 * slope
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.clip(np.nan_to_num(-bend / (3 * twist)), 0.0, 1.0)  # where it is fastest within a curve
        middle = first + turn * (2 * bend + 3 * turn * twist)
        fastest = np.abs(np.stack((first, second, middle))).max(axis=(0, 2))
        counts = np.maximum(1, np.ceil(fastest / step)).astype(int)
        index = np.repeat(np.arange(len(counts)), counts)
        s = ((np.arange(1, len(index) + 1) - (np.cumsum(counts) - counts)[index]) / counts[index])[:, None]
        between = self.positions[index] + s * (first[index] + s * (bend[index] + s * twist[index]))
        return np.concatenate((self.positions[:1], between))


class Spline:
    """The natural cubic spline along waypoints of shape (m, n), by the length [rad or m] of the lines between them.

    It has what toppra asks of a path. That of scipy is the same, but importing it takes 25 MB and 0.2 s.
    """

    def __init__(self, waypoints: Array) -> None:
        steps = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
        self.knots: Array = np.concatenate([[0.0], np.cumsum(steps)])
        self.path_interval = self.knots[[0, -1]]
        self.dof: int = waypoints.shape[1]
        h = np.diff(self.knots)
        slopes = np.diff(waypoints, axis=0) / h[:, None]
        self.bends = _bends(h.tolist(), slopes)
        """Second derivatives at the knots, of shape (m, n)."""
        first, last = self.bends[:-1], self.bends[1:]
        starts = slopes - h[:, None] * (2 * first + last) / 6
        self._pieces = waypoints[:-1], starts, first / 2, (last - first) / (6 * h[:, None])

    def __call__(self, at: Array, order: int = 0) -> Array:
        """Return positions, or derivatives of this order up to 2, of shape (k, n)."""
        if len(self.knots) == 2:  # a straight line
            start, slope, *_ = self._pieces
            return start + at[:, None] * slope if order == 0 else np.repeat(slope * (order == 1), len(at), axis=0)
        index = np.clip(np.searchsorted(self.knots, at, side="right") - 1, 0, len(self.knots) - 2)
        t = (at - self.knots[index])[:, None]
        a, b, c, d = (each[index] for each in self._pieces)
        if order == 0:
            return a + t * (b + t * (c + t * d))
        return b + t * (2 * c + 3 * t * d) if order == 1 else 2 * c + 6 * t * d


def _bends(h: list[float], slopes: Array) -> Array:
    """Return second derivatives at all knots, 0 at both ends: Thomas's algorithm for the tridiagonal equations."""
    bends = np.zeros((len(h) + 1, slopes.shape[1]))
    bends[1:-1] = 6 * np.diff(slopes, axis=0)
    diagonal = [1.0, *(2 * (before + after) for before, after in pairwise(h))]
    for at in range(2, len(h)):
        factor = h[at - 1] / diagonal[at - 1]
        diagonal[at] -= factor * h[at - 1]
        bends[at] -= factor * bends[at - 1]
    for at in range(len(h) - 1, 0, -1):
        bends[at] = (bends[at] - h[at] * bends[at + 1]) / diagonal[at]
    return bends


@cache
def toppra() -> Any:
    """Import toppra without matplotlib and scipy: 60 MB and 0.8 s for what is never called here.

    Raises:
        ModuleNotFoundError: if the extra `arm` is not installed.
    """
    later = {name: _Later(name) for name in UNUSED if name not in sys.modules}
    for name, module in later.items():
        parent, _, own = name.rpartition(".")
        if parent in later:
            setattr(later[parent], own, module)
    sys.modules.update(later)
    try:
        found = import_module("toppra")
    finally:
        for name in later:
            del sys.modules[name]
    logging.getLogger("toppra").setLevel(logging.CRITICAL)  # what it says is in the result
    return found


class _Later(ModuleType):
    """Stands for a module that is imported once one of its functions is called."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *values, **options: getattr(import_module(self.__name__), name)(*values, **options)


def speeds_of(space: JointSpace, speed: float, acceleration: float) -> tuple[Array, Array]:
    """Return the greatest speeds and accelerations of joints, scaled by two shares from 0 to 1, each of shape (n,)."""
    fast = np.array([DEFAULT_SPEED if item.limits.velocity is None else item.limits.velocity for item in space.joints])
    hard = [
        most / SECONDS_TO_SPEED if joint.limits.acceleration is None else joint.limits.acceleration
        for joint, most in zip(space.joints, fast.tolist(), strict=True)
    ]
    return fast * speed, np.array(hard) * acceleration


def timed(waypoints: Array, velocities: Array, accelerations: Array, jerks: Array | None = None) -> Trajectory | str:
    """Return the fastest trajectory along waypoints of shape (m, n), at rest at both ends; or why there is none.

    With limits of jerks it is not quite the fastest one: see `jerk_limits`.
    """
    if np.any(velocities <= 0.0) or np.any(accelerations <= 0.0):
        return "a limit of speed or acceleration is 0"
    path, planned, is_line = Spline(waypoints), (MARGIN * velocities, MARGIN * accelerations), len(waypoints) == 2
    timing = _line_timing(path, *planned) if is_line else _curve_timing(path, *planned)
    if timing is None or not math.isfinite(timing.times[-1]):
        return f"no velocities along {len(waypoints)} points keep the limits"
    if jerks is None:
        made = [_sampled(path, timing, timing.times if is_line else timing.times[[0, -1]])]
    else:
        longest = max(LEAST_WINDOW, float(np.max(2.0 * accelerations / jerks)))
        made = [_averaged(path, timing, longest * share) for share in WINDOWS]
    limits = (velocities, accelerations, jerks)
    kept = [trajectory for each in made if (trajectory := _kept(each, waypoints, *limits)) is not None]
    return min(kept, key=lambda one: one.duration) if kept else "its velocities are not finite"


def curve(waypoints: Array, step: float) -> Array:
    """Return positions on the curve of `timed`, about `step` [rad or m] apart, of shape (k, n)."""
    path = Spline(waypoints)
    length = path.knots[-1]
    return path(np.linspace(0.0, length, math.ceil(length / step) + 1))


def _line_timing(path: Spline, velocities: Array, accelerations: Array) -> PathTiming:
    """Return the fastest timing of a straight line: as hard as all joints can, as fast as all can, and as hard.

    One that is hardly ever as fast has no samples there, which would be too near to each other in time.
    """
    shares = np.abs(path(path.knots[:1], 1)[0])
    moves, length = shares > 0.0, float(path.knots[-1])
    hardest = float(np.min(accelerations[moves] / shares[moves]))
    fastest = min(float(np.min(velocities[moves] / shares[moves])), math.sqrt(hardest * length))
    ramp = fastest**2 / (2 * hardest)
    if length - 2 * ramp < SHORTEST * length:
        return PathTiming(np.array([0.0, length / 2, length]), np.array([0.0, fastest, 0.0]))
    return PathTiming(np.array([0.0, ramp, length - ramp, length]), np.array([0.0, fastest, fastest, 0.0]))


def _curve_timing(path: Spline, velocities: Array, accelerations: Array) -> PathTiming | None:
    """Return the fastest timing of a path by TOPP-RA, None if there is none."""
    grid = _grid(path.knots, path.bends)
    constraints = _constraints(tuple(velocities), tuple(accelerations))
    solver = toppra().algorithm.TOPPRA(constraints, path, gridpoints=grid, parametrizer="ParametrizeConstAccel")
    _, speeds, _ = solver.compute_parameterization(0, 0)
    return None if speeds is None else PathTiming(grid, np.asarray(speeds))


def _sampled(path: Spline, timing: PathTiming, between: Array) -> Trajectory:
    """Return a trajectory as it is timed; with samples at the times [s] where accelerations change, it is exact."""
    steps = np.diff(between)
    counts = np.ceil(np.maximum(steps / SAMPLE, LEAST_SAMPLES / len(steps))).astype(int).tolist()
    parts = [np.linspace(between[at], between[at + 1], count, endpoint=False) for at, count in enumerate(counts)]
    times = np.concatenate((*parts, between[-1:]))
    places, paces = timing.at(times)
    return Trajectory(times, path(places), path(places, 1) * paces[:, None])


@lru_cache(maxsize=8)
def _constraints(velocities: tuple[float, ...], accelerations: tuple[float, ...]) -> list[Any]:
    """Return limits as toppra has them: it takes as long to make them as to search a path."""
    bounds = [np.array([(-most, most) for most in each]) for each in (velocities, accelerations)]
    constraint = toppra().constraint
    return [constraint.JointVelocityConstraint(bounds[0]), constraint.JointAccelerationConstraint(bounds[1])]


def _averaged(path: Spline, timing: PathTiming, window: float) -> Trajectory:
    """Return a trajectory whose pace is a mean over a window [s]."""
    count = math.ceil((float(timing.times[-1]) + window) / min(SAMPLE, window / IN_WINDOW)) + 1
    times, places, paces = timing.mean(window, count)
    return Trajectory(times, path(places), path(places, 1) * paces[:, None])


def _kept(
    made: Trajectory, waypoints: Array, velocities: Array, accelerations: Array, jerks: Array | None
) -> Trajectory | None:
    """Return it from rest to rest, slowed down until it keeps all limits; None if it is no motion."""
    times, positions, speeds = made.times, made.positions, made.velocities
    positions[0], positions[-1], speeds[0], speeds[-1] = waypoints[0], waypoints[-1], 0.0, 0.0
    if not all(np.all(np.isfinite(array)) for array in (times, positions, speeds)):
        return None
    excess = made.excess(velocities, accelerations)
    if jerks is not None:
        excess = max(excess, float(np.max(np.abs(jerks_between(times, speeds)) / jerks)) ** (1 / 3))
    return made.slowed(max(1.0, excess * (1.0 + 1e-9)))


def _grid(knots: Array, bends: Array) -> Array:
    """Return where limits are regarded on a cubic spline, whose second derivatives at its knots have the shape (m, n).

    As toppra itself does, half of the second derivative times the square of a step is at most `BEND` [rad or m]; but
    toppra finds steps by trying, which took a third of the time of all the rest.
    """
    hardest = np.abs(bends).max(axis=1)
    most = np.maximum(hardest[:-1], hardest[1:])  # they are linear between knots
    dense = np.maximum(np.sqrt(most / (2 * BEND)), max(1 / LONGEST, LEAST_GRID / knots[-1]))
    counts = np.ceil(np.diff(knots) * dense).astype(int).tolist()
    parts = [np.linspace(knots[at], knots[at + 1], count, endpoint=False) for at, count in enumerate(counts)]
    return np.concatenate((*parts, knots[-1:]))
