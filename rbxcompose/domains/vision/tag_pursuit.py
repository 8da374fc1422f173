"""Driving so that something stays ahead at a distance.

The law and its figures are those of the follower in P. Goebel, ROS By Example, volume 2 (2015), chapter 10, with an
angle in place of a distance to the side, and with accelerations that a base can do.
"""

from __future__ import annotations

import math

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Velocity2

ASIDE = math.radians(60)  # beyond this bearing it only turns
SLOWS, EACH = 1.5, 0.1  # by which speeds are divided in each such time [s] without a target
RESTS = 0.01  # [m/s, rad/s] below which it stands


@dataclass(frozen=True, slots=True)
class FollowingSettings:
    """How to follow; all above zero."""

    distance: float = 0.7
    """To keep [m]."""
    tolerance: float = 0.1
    """By which the distance may be off [m]."""
    bearing: float = math.radians(4)
    """To either side, at which it does not turn [rad]."""
    gain: float = 1.0
    """Speed for each metre that the distance is off [1/s]."""
    turn_gain: float = 2.5
    """Turn rate for the bearing [1/s]."""
    slowest: float = 0.05
    """If it moves at all [m/s]."""
    speed: float = 0.5
    """At most [m/s]."""
    back_speed: float = 0.3
    """Backwards, at most [m/s]."""
    turn_rate: float = 1.5
    """At most [rad/s]."""
    acceleration: float = 0.5
    """[m/s^2]."""
    turn_acceleration: float = 3.0
    """[rad/s^2]."""


BACK = 1.5  # times as much gain backwards: what comes up is urgent


def wanted(settings: FollowingSettings, distance: float, bearing: float) -> Velocity2:
    """Return the velocity for a target at a distance [m] and a bearing [rad, to the left]."""
    turn = 0.0
    if abs(bearing) > settings.bearing:
        turn = math.copysign(min(abs(bearing) * settings.turn_gain, settings.turn_rate), bearing)
    off = distance - settings.distance
    if abs(off) <= settings.tolerance or abs(bearing) > ASIDE:
        return Velocity2(0.0, turn)
    gain, most = (settings.gain, settings.speed) if off > 0 else (settings.gain * BACK, settings.back_speed)
    return Velocity2(math.copysign(min(max(abs(off) * gain, min(settings.slowest, most)), most), off), turn)


class Following:
    """What it commands, from cycle to cycle."""

    def __init__(self) -> None:
        self.velocity = AT_REST

    def towards(self, settings: FollowingSettings, distance: float, bearing: float, dt: float) -> Velocity2:
        """Return the velocity `dt` [s] after the last one, with a target at a distance [m] and a bearing [rad]."""
        goal, last = wanted(settings, distance, bearing), self.velocity
        self.velocity = Velocity2(
            _nearer(last.linear, goal.linear, settings.acceleration * dt),
            _nearer(last.angular, goal.angular, settings.turn_acceleration * dt),
        )
        return self.velocity

    def without(self, dt: float) -> Velocity2:
        """Return the velocity `dt` [s] after the last one, without a target: slower and slower."""
        share = SLOWS ** (-dt / EACH)
        linear, angular = self.velocity.linear * share, self.velocity.angular * share
        self.velocity = Velocity2(linear, angular) if max(abs(linear), abs(angular)) > RESTS else AT_REST
        return self.velocity

    def halt(self) -> Velocity2:
        """Return that it stands, at once."""
        self.velocity = AT_REST
        return AT_REST


def _nearer(last: float, goal: float, most: float) -> float:
    return last + min(max(goal - last, -most), most)
