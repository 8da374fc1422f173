"""From the points of a path to a trajectory within the limits of joints, by TOPP-RA.

Points of the path are joined by a cubic spline. It is sampled, and the trajectory is what the controller makes of the
samples: cubic Hermite curves. These are verified, and slowed down if they exceed a limit. Source of the algorithm: Pham
and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis (2018).
"""

from __future__ import annotations

import logging
import math

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]

MARGIN = 0.95
"""Share of the limits that is planned with: the rest is left to the limiter of each joint, to catch up."""
DEFAULT_SPEED = 1.0  # [rad/s or m/s] of a joint without a limit
SECONDS_TO_SPEED = 0.5  # [s] in which a joint without a limit of acceleration reaches its speed
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
        h, slope = np.diff(self.times), np.diff(self.positions, axis=0)
        reach = np.abs(slope) + h[:, None] * (np.abs(self.velocities[:-1]) + np.abs(self.velocities[1:]))
        found = [self.positions[:1]]
        for index, count in enumerate(np.maximum(1, np.ceil(reach.max(axis=1) / step)).astype(int).tolist()):
            s = (np.arange(1, count + 1) / count)[:, None]
            first, second = self.velocities[index] * h[index], self.velocities[index + 1] * h[index]
            bend, twist = 3 * slope[index] - 2 * first - second, first + second - 2 * slope[index]
            found.append(self.positions[index] + s * (first + s * (bend + s * twist)))
        return np.concatenate(found)


def speeds_of(space: JointSpace, speed: float, acceleration: float) -> tuple[Array, Array]:
    """Return the greatest speeds and accelerations of joints, scaled by two shares from 0 to 1, each of shape (n,)."""
    fast = np.array([DEFAULT_SPEED if one.limits.velocity is None else one.limits.velocity for one in space.joints])
    hard = [
        most / SECONDS_TO_SPEED if one.limits.acceleration is None else one.limits.acceleration
        for one, most in zip(space.joints, fast.tolist(), strict=True)
    ]
    return fast * speed, np.array(hard) * acceleration


def timed(waypoints: Array, velocities: Array, accelerations: Array) -> Trajectory | str:
    """Return the fastest trajectory along waypoints of shape (m, n), at rest at both ends; or why there is none."""
    import toppra
    from toppra import algorithm, constraint

    logging.getLogger("toppra").setLevel(logging.CRITICAL)  # what it says is told in the result
    if np.any(velocities <= 0.0) or np.any(accelerations <= 0.0):
        return "a limit of speed or acceleration is 0"
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1))])
    path = toppra.SplineInterpolator(way, waypoints, bc_type="natural")
    bounds = [np.stack((-MARGIN * most, MARGIN * most), axis=1) for most in (velocities, accelerations)]
    constraints = [constraint.JointVelocityConstraint(bounds[0]), constraint.JointAccelerationConstraint(bounds[1])]
    found = algorithm.TOPPRA(constraints, path, parametrizer="ParametrizeConstAccel").compute_trajectory(0, 0)
    if found is None or not math.isfinite(found.duration):
        return f"no velocities along {len(waypoints)} points keep the limits"
    times = np.linspace(0.0, found.duration, max(LEAST_SAMPLES, math.ceil(found.duration / SAMPLE)) + 1)
    positions, speeds = np.asarray(found(times)), np.asarray(found(times, 1))
    positions[0], positions[-1], speeds[0], speeds[-1] = waypoints[0], waypoints[-1], 0.0, 0.0
    made = Trajectory(times, positions, speeds)
    if not all(np.all(np.isfinite(one)) for one in (times, positions, speeds)):
        return "its velocities are not finite"
    return made.slowed(max(1.0, made.excess(velocities, accelerations) * (1.0 + 1e-9)))
