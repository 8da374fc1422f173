"""Where a base is, by the positions of its two wheels."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from rbxcompose.control.diff_drive import WheelGeometry, WheelSpeeds
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import AT_REST, Pose2, Velocity2

Covariance = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class OdometryPolicy:
    """How far odometry is trusted."""

    variance_per_metre: float = 1e-4
    """Of the way of a wheel, for each metre of it [m^2/m]."""
    greatest_speed: float = math.inf
    """A wheel that seems faster than this has jumped [m/s]: its way does not count."""
    resolution: float = 0.0
    """Way of a wheel for one tick of its reading [m]."""
    window: float = 0.0
    """Over how long velocities are averaged [s], since ticks make those between two readings rough."""


class WheelOdometry:
    """Adds up exact arcs between readings: rolling wheels whose speeds keep their ratio lose nothing.

    The covariance of (x, y, heading) grows as in Siegwart and Nourbakhsh, Introduction to Autonomous Mobile Robots,
    section 5.2.4: with the way of each wheel, both independent of each other.
    """

    def __init__(self, geometry: WheelGeometry, policy: OdometryPolicy, pose: Pose2 | None = None) -> None:
        self.geometry, self.policy = geometry, policy
        self.pose = pose or Pose2()
        self.velocity = AT_REST
        self.covariance: Covariance = np.zeros((3, 3))  # of x [m], y [m], heading [rad]
        self.velocity_covariance: Covariance = np.zeros((2, 2))  # of linear [m/s], angular [rad/s]
        self.jumps = 0  # readings whose way did not count
        self._last: tuple[float, float, float] | None = None  # left, right, time
        self._ways = (0.0, 0.0)  # of the wheels so far [m]
        self._past: deque[tuple[float, float, float]] = deque()  # time and ways, over the window

    def update(self, left: float, right: float, now: float) -> str | None:
        """Take in positions of the wheels [rad or ticks] at `now` [s]; return why they do not count, else None.

        The first ones are where it starts; those of the same moment, or of an earlier one, do not count.
        """
        if not (math.isfinite(left) and math.isfinite(right) and math.isfinite(now)):
            return f"the wheels are at {left} and {right}, at {now} s: not finite"
        before = self._last
        if before is not None and now <= before[2]:
            return f"a reading of {now:.3f} s came after one of {before[2]:.3f} s"
        self._last = (left, right, now)
        if before is None:
            self._past.append((now, *self._ways))
            return None
        dt = now - before[2]
        wheels = WheelSpeeds(self._difference(left, before[0]) / dt, self._difference(right, before[1]) / dt)
        way = max(abs(wheels.left), abs(wheels.right)) * self.geometry.metres_per_unit * dt
        speed = way / max(dt, self.policy.window)  # readings come late at times, and the next one soon after
        if speed > self.policy.greatest_speed:
            self.jumps += 1
            return f"a wheel has jumped: it would have moved at {speed:.3g} m/s"
        self._move(wheels, dt)
        self._average(now)
        return None

    def _difference(self, new: float, old: float) -> float:
        counts = self.geometry.counts
        return new - old if counts is None else (new - old + counts / 2) % counts - counts / 2

    def _move(self, wheels: WheelSpeeds, dt: float) -> None:
        velocity, scale = self.geometry.velocity(wheels), self.geometry.metres_per_unit * dt
        left, right = wheels.left * scale, wheels.right * scale
        self._ways = self._ways[0] + left, self._ways[1] + right
        self._spread(left, right, self.pose.heading + velocity.angular * dt / 2.0)
        self.pose = self.pose.moved(velocity, dt)

    def _average(self, now: float) -> None:
        """Take the velocity from the ways over the window, at least from the last two readings."""
        past = self._past
        past.append((now, *self._ways))
        while len(past) > 2 and past[1][0] <= now - self.policy.window:
            past.popleft()
        time, left, right = past[0]
        span, distance = now - time, self.geometry.wheel_distance
        ways = self._ways[0] - left, self._ways[1] - right
        self.velocity = Velocity2((ways[0] + ways[1]) / 2.0 / span, (ways[1] - ways[0]) / distance / span)
        by_wheels = np.array([[0.5, 0.5], [-1.0 / distance, 1.0 / distance]]) / span
        rounding = self.policy.resolution**2 / 6.0  # of two readings
        noise = np.diag([self.policy.variance_per_metre * abs(way) + rounding for way in ways])
        self.velocity_covariance = by_wheels @ noise @ by_wheels.T

    def _spread(self, left: float, right: float, direction: float) -> None:
        """Carry the covariance along, and add that of the ways of both wheels [m]."""
        distance = self.geometry.wheel_distance
        way, cos, sin = (left + right) / 2.0, math.cos(direction), math.sin(direction)
        by_pose = np.array([[1.0, 0.0, -way * sin], [0.0, 1.0, way * cos], [0.0, 0.0, 1.0]])
        turned = way / (2.0 * distance)
        by_wheels = np.array(
            [
                [cos / 2.0 + turned * sin, cos / 2.0 - turned * sin],
                [sin / 2.0 - turned * cos, sin / 2.0 + turned * cos],
                [-1.0 / distance, 1.0 / distance],
            ]
        )
        noise = self.policy.variance_per_metre * np.diag([abs(left), abs(right)])
        self.covariance = by_pose @ self.covariance @ by_pose.T + by_wheels @ noise @ by_wheels.T
